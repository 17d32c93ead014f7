"""The command line `optsat`: one place for exit codes and for what an error looks like."""

import os
import sys
import traceback
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from optsat.commands import (
    attitude,
    bench,
    cache,
    demo,
    doctor,
    export,
    reproduce,
    simulate,
    study,
    study_compare,
    study_report,
    verify,
    view,
)
from optsat.commands.output import note
from optsat.errors import OptsatError

USAGE = 2
INTERRUPTED = 130
CLOSED_PIPE = 141


class _Root(TyperGroup):
    """Root of all commands: turns what they raise into one sentence and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        try:
            try:
                return super().invoke(ctx)
            finally:
                sys.stdout.flush()
        except BrokenPipeError:
            # the reader has gone: nobody is left to tell, and the interpreter must not try again at exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(CLOSED_PIPE) from None
        except KeyboardInterrupt:
            note("optsat: interrupted")
            raise typer.Exit(INTERRUPTED) from None
        except (OptsatError, OSError) as error:
            if os.environ.get("OPTSAT_TRACEBACK"):
                traceback.print_exc()
            note(f"optsat: {error}")
            raise typer.Exit(USAGE) from None


app = typer.Typer(
    cls=_Root,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich draws help in 0.15 s more than it takes to read it
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Example: optsat doctor. Exit codes: 0 done, 1 a finding, 2 wrong usage or bad input.",
)
app.command("demo", epilog="Example: optsat demo --out my-demo")(demo.demo_command)
app.command("attitude", epilog="Example: optsat attitude log.csv --window 60 --plot attitude.svg")(
    attitude.attitude_command
)
app.command("view", epilog="Example: optsat view log.csv --window 60 --out page.html")(view.view_command)
app.command("verify", epilog="Example: optsat verify certificate.json")(verify.verify_command)
app.command("simulate", epilog="Example: optsat simulate scenario.toml --out log.csv --seed 1")(
    simulate.simulate_command
)
app.command("export", epilog="Example: optsat export rigid_body_step --target cortex-m7 --out flight")(
    export.export_command
)
study.app.command("report", epilog="Example: optsat study report results --format pdf")(study_report.report_command)
study.app.command("compare", epilog="Example: optsat study compare before after")(study_compare.compare_command)
app.add_typer(study.app, name="study", epilog="Example: optsat study list")
app.command("reproduce", epilog="Example: optsat reproduce --out papers --resume")(reproduce.reproduce_command)
app.command("bench", epilog="Example: optsat bench kernels --json")(bench.bench_command)
app.add_typer(cache.app, name="cache", epilog="Example: optsat cache show")
app.command("doctor", epilog="Example: optsat doctor --json")(doctor.doctor_command)


def _print_version(asked: bool) -> None:
    if asked:
        from optsat._version import __version__

        typer.echo(f"optsat {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and stop."),
    ] = False,
) -> None:
    """Attitude software that can be trusted in flight."""


def main() -> None:
    """Run the command line and leave the process with its exit code."""
    app(prog_name="optsat")


if __name__ == "__main__":
    main()
