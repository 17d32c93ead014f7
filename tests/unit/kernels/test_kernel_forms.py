"""Every form of a kernel: the same calls, the same results to the last bit, the same refusals."""

import array
import pickle

import numpy as np
import pytest
from kernel_examples import FORMS, bits, doubled, equations, samples, solving, turning, use_form

from optsat.errors import InputError, UnknownOptionError
from optsat.kernels import interpreted
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.status import Status
from optsat.kernels.unit import Real

pytestmark = pytest.mark.filterwarnings("ignore::optsat.kernels.interpreted.CompilerMissing")


@pytest.fixture(params=FORMS)
def form(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    use_form(request.param, monkeypatch)
    return str(request.param)


@pytest.fixture
def kernel(form: str) -> Kernel:
    return make_kernel(turning())


def test_it_says_its_form(kernel: Kernel, form: str) -> None:
    assert kernel.form == ("casadi" if form == "interpreted" else form)
    assert make_kernel(solving()).form == ("python" if form == "interpreted" else form)
    assert repr(kernel).startswith("<kernel turning(x (3,) [m] in B, ")


def test_the_bits_are_those_of_casadi(kernel: Kernel) -> None:
    x, J, t = samples(20)
    batch = kernel.batch(x, J, t)
    assert [result.shape for result in batch] == [(20, 2), (20, 3, 3), (20,), (20, 2)]
    for k in range(20):
        exact = [result.full() for result in turning().casadi.call([x[k], J[k], t[k]])]
        exact = [exact[0][:, 0], exact[1], exact[2][0, 0], exact[3][:, 0]]
        for found, row, expected in zip(kernel(x[k], J[k], t[k]), batch, exact, strict=True):
            assert bits(found) == bits(row[k]) == bits(expected)


def test_results_are_fresh_and_of_their_shape(kernel: Kernel) -> None:
    x, J, t = samples(2)
    first = kernel(x[0], J[0], t[0])
    kept = [bits(result) for result in first]
    kernel(x[1], J[1], t[1])
    assert [bits(result) for result in first] == kept
    assert [np.shape(result) for result in first] == [(2,), (3, 3), (), (2,)]
    assert type(first[2]) is np.float64
    assert type(first[0]) is np.ndarray


def test_one_result_comes_unpacked(form: str) -> None:
    kernel = make_kernel(doubled())
    assert kernel([1, 2, 3]).tolist() == [2, 4, 6]
    assert kernel.batch([[1, 2, 3]]).tolist() == [[2, 4, 6]]
    assert kernel(y := np.array([1e-310, -0.0, 5e-324])).tobytes() == (y + y).tobytes()


def test_arguments_of_any_kind_are_taken(kernel: Kernel) -> None:
    x, J, t = (each[0] for each in samples(1))
    expected = [bits(result) for result in kernel(x, J, t)]
    strided = np.zeros((3, 5))[:, ::2]
    strided[:, :2] = J
    unaligned = np.frombuffer(b"." + x.tobytes(), np.float64, 3, offset=1)
    for given in (
        (x.tolist(), J.tolist(), float(t)),
        (x.astype(">f8"), J.astype(">f8"), np.float64(t)),
        (unaligned, strided[:, :2], np.array(t)),
        (array.array("d", x), np.asfortranarray(J), t),
        (tuple(x), memoryview(J), t),
    ):
        assert [bits(result) for result in kernel(*given)] == expected
    assert [bits(result) for result in kernel(x, t=t, J=J)] == expected
    whole = kernel([1, 2, 3], np.ones((3, 2), np.int32), 0)
    assert whole[0].tolist() == [6, 6]
    assert kernel(x.astype(np.float32), J, t)[2] == kernel(x.astype(np.float32).astype(float), J, t)[2]


def test_refusals_name_the_port(kernel: Kernel) -> None:
    x, J, t = (each[0] for each in samples(1))
    for given, message in (
        ((x[:2], J, t), r"turning: `x` must have shape \(3,\) \[m\], got \(2,\)\.$"),
        ((x, J.T, t), r"`J` must have shape \(3, 2\)"),
        ((x, J, x), r"`t` must have shape \(\)"),
        ((np.ones((4, 3)), J, t), r"got \(4, 3\)\. Use `\.batch`"),
        (([1, np.nan, 3], J, t), r"turning: `x` must be finite \[m\]: index 1 holds nan"),
        ((x, J * [[1], [1], [np.inf]], t), r"turning: `J` must be finite \[-\]: row 2 holds inf"),
        ((x, J, np.nan), r"turning: `t` must be finite \[s\]: the value holds nan"),
        ((x, J, -np.inf), r"turning: `t` must be finite"),
        ((np.array(["a", "b", "c"]), J, t), "`x` must hold numbers"),
        ((x + 0j, J, t), "`x` must be real"),
        ((x > 0, J, t), "`x` must hold numbers"),
        ((np.ma.masked_array(x, [True, False, False]), J, t), r"`x` has a masked entry at index \(0,\)"),
        ((x, J), r"turning: input t \(\) \[s\] is missing"),
        ((x, J, t, t), "takes 3 arguments, got 4"),
    ):
        with pytest.raises(InputError, match=message):
            kernel(*given)
    with pytest.raises(InputError, match="`x` was given by position and by name"):
        kernel(x, x=x)
    with pytest.raises(UnknownOptionError, match=r"turning has no input `tt`\. Did you mean `t`"):
        kernel(x, J, tt=t)


@pytest.mark.parametrize("count", [0, 1, 2, 16, 17, 1023, 1024, 1025])
def test_a_batch_is_the_calls(kernel: Kernel, count: int) -> None:
    x, J, t = samples(count)
    together = kernel.batch(x, J, t)
    for k in {0, 1, count // 2, count - 1} & set(range(count)):
        for whole, single in zip(together, kernel(x[k], J[k], t[k]), strict=True):
            assert bits(whole[k]) == bits(single)


def test_a_batch_shares_what_has_no_sample_axis(kernel: Kernel) -> None:
    x, J, t = samples(30)
    repeated = kernel.batch(x, np.repeat(J[:1], 30, 0), np.full(30, 0.5))
    for one, other in zip(kernel.batch(x, J[0], 0.5), repeated, strict=True):
        assert bits(one) == bits(other)
    assert [result.shape for result in kernel.batch(x[0], J[0], t)] == [(30, 2), (30, 3, 3), (30,), (30, 2)]


def test_threads_do_not_change_the_results(kernel: Kernel) -> None:
    x, J, t = samples(5000)
    expected = [bits(result) for result in kernel.batch(x, J, t)]
    for threads in (2, 3, 7):
        assert [bits(result) for result in kernel.batch(x, J, t, threads=threads)] == expected


def test_a_batch_refuses_what_a_call_does(kernel: Kernel) -> None:
    x, J, t = samples(3000)
    bad = J.copy()
    bad[2345, 1, 1] = np.nan
    for threads in (1, 2):
        with pytest.raises(InputError, match=r"turning: `J` must be finite \[-\]: row 2345 holds nan"):
            kernel.batch(x, bad, t, threads=threads)
    with pytest.raises(InputError, match=r"`J` must be finite"):
        kernel.batch(x, bad[2345], t)
    with pytest.raises(InputError, match="`x` 3000, `J` 2"):
        kernel.batch(x, J[:2], 1.0)
    with pytest.raises(InputError, match="same number of samples; lengths: none"):
        kernel.batch(x[0], J[0], 1.0)
    with pytest.raises(InputError, match=r"turning\.batch: `x` must have shape \(N, 3\)"):
        kernel.batch(x[:, :2], J, t)
    with pytest.raises(InputError, match="`threads` must be a whole number from 1, got 0"):
        kernel.batch(x, J, t, threads=0)
    with pytest.raises(InputError, match="`layout` must be 'rows' or 'tiles', got 'columns'"):
        kernel.batch(x, J, t, layout="columns")  # type: ignore[arg-type]


def test_a_batch_of_any_arrays(kernel: Kernel) -> None:
    x, J, t = samples(40)
    expected = [bits(result) for result in kernel.batch(x, J, t)]
    for given in ((x.astype(">f8"), np.asfortranarray(J), t.tolist()), (x[::-1][::-1], J.tolist(), t)):
        assert [bits(result) for result in kernel.batch(*given)] == expected


def test_results_may_be_given_their_place(kernel: Kernel) -> None:
    x, J, t = samples(40)
    expected = kernel.batch(x, J, t)
    out = [np.full_like(result, 7.0) for result in expected]
    found = kernel.batch(x, J, t, out=out)
    assert all(one is other for one, other in zip(found, out, strict=True))
    assert [bits(result) for result in out] == [bits(result) for result in expected]
    read_only = out[0].copy()
    read_only.flags.writeable = False
    for place, message in (
        (out[:2], "`out` must hold 4 arrays, got 2"),
        ([out[0][:5], *out[1:]], r"`out` for `y` must be a contiguous, writable array \(40, 2\) of float64"),
        ([read_only, *out[1:]], "`out` for `y` must be a contiguous, writable array"),
        ([out[0].astype(np.float32), *out[1:]], r"got float32 \(40, 2\)"),
        ([*out[:3], out[0]], "`out` for `constant` shares memory with an argument or another result"),
        ([x.ravel()[:80].reshape(40, 2), *out[1:]], "`out` for `y` shares memory with an argument"),
    ):
        with pytest.raises(InputError, match=message):
            kernel.batch(x, J, t, out=place)


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 2500])
def test_tiles_hold_the_same_bits(kernel: Kernel, count: int) -> None:
    x, J, t = samples(count)
    expected = [bits(result) for result in kernel.batch(x, J, t)]
    tiles = kernel.to_tiles(x, J, t)
    width = kernel.record.width
    assert [tile.shape for tile in tiles] == [(-(-count // width), size, width) for size in (3, 6, 1)]
    for threads in (1, 2):
        found = kernel.batch(*tiles, layout="tiles", threads=threads)
        assert [bits(result) for result in kernel.from_tiles(*found, count=count)] == expected
    shared = kernel.to_tiles(x, J[0], 0.5)
    found = kernel.from_tiles(*kernel.batch(*shared, layout="tiles"), count=count)
    for one, other in zip(found, kernel.batch(x, J[0], 0.5), strict=True):
        assert bits(one) == bits(other)


def test_tiles_are_checked(kernel: Kernel) -> None:
    x, J, t = samples(50)
    tiles = kernel.to_tiles(x, J, t)
    bad = tiles[1].copy()
    bad[1, 2, 0] = np.inf
    with pytest.raises(InputError, match=r"turning: `J` must be finite \[-\]: row \d+ holds inf"):
        kernel.batch(tiles[0], bad, tiles[2], layout="tiles")
    with pytest.raises(InputError, match=r"`x` must be an array \(tiles, 3, \d+\) of float64, got float64 \(50, 3\)"):
        kernel.batch(x, J, t, layout="tiles")
    with pytest.raises(InputError, match="`x` must be finite"):
        kernel.to_tiles(x * np.nan, J, t)
    with pytest.raises(InputError, match=r"`y` must have shape \(tiles, 2, \d+\) with 50 samples"):
        kernel.from_tiles(*tiles, tiles[0], count=50)


def test_the_status_comes_after_the_results(form: str) -> None:
    kernel = make_kernel(solving())
    A, b = equations(30)
    x, ratio, status = kernel(A[1], b[1])
    assert status is Status.OK
    assert ratio > 0.0
    np.testing.assert_allclose(A[1] @ x, b[1], atol=1e-9)
    x, _, status = kernel(A[0], b[0])
    assert status is Status.RANGE
    assert np.isnan(x).all()
    many, ratios, statuses = kernel.batch(A, b)
    assert statuses.dtype == np.int32
    assert (statuses == Status.OK).tolist() == [k % 3 != 0 for k in range(30)]
    for k in range(30):
        x, ratio, status = kernel(A[k], b[k])
        assert (bits(x), bits(ratio), status) == (bits(many[k]), bits(ratios[k]), statuses[k])


def test_forms_agree_on_a_kernel_with_loops(form: str) -> None:
    A, b = equations(30)
    twin = solving().twin
    assert twin is not None
    x, ratios, statuses = make_kernel(solving()).batch(A, b)
    for k in range(30):
        status, y = twin(np.concatenate([A[k].ravel(), b[k]]))
        assert status == statuses[k]
        np.testing.assert_array_equal(y, [*x[k], ratios[k]])


@pytest.mark.parametrize("form", FORMS[:3])
def test_single_precision(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use_form(form, monkeypatch)
    kernel, (x, J, t) = make_kernel(turning(), real="float"), samples(50)
    exact = make_kernel(turning()).batch(x, J, t)
    single = [np.asarray(each, np.float32) for each in (x, J, t)]
    batch = kernel.batch(*single)
    assert [result.dtype for result in batch] == [np.float32] * 4
    for one, other in zip(batch, exact, strict=True):
        np.testing.assert_allclose(one, other, rtol=2e-5, atol=2e-6)
    for given in ((x, J, t), (x.tolist(), J[:, ::1], single[2])):
        assert [bits(result) for result in kernel.batch(*given)] == [bits(result) for result in batch]
    for k in (0, 49):
        found = kernel(x[k], single[1][k], float(t[k]))
        assert [bits(result) for result in found] == [bits(result[k]) for result in batch]
        assert type(found[2]) is np.float32
        assert found[0].dtype == np.float32
    tiles = kernel.to_tiles(x, J, t)
    again = kernel.from_tiles(*kernel.batch(*tiles, layout="tiles"), count=50)
    assert [bits(result) for result in again] == [bits(result) for result in batch]
    with pytest.raises(InputError, match=r"turning: `t` holds 1e\+39, which float cannot hold \(at most 3.4e38\)"):
        kernel(x[0], J[0], 1e39)
    with pytest.raises(InputError, match=r"`x` holds -1e\+300, which float cannot hold"):
        kernel.batch(np.where(x == x[3, 1], -1e300, x), J, t)
    with pytest.raises(InputError, match=r"`J` must be finite \[-\]: row 31 holds inf"):
        kernel.batch(single[0], np.where(np.arange(50)[:, None, None] == 31, np.float32(np.inf), single[1]), single[2])


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("form", FORMS[:3])
def test_every_place_is_looked_at(form: str, real: Real, monkeypatch: pytest.MonkeyPatch) -> None:
    use_form(form, monkeypatch)
    kernel = make_kernel(solving(), real=real)
    A, b = (np.asarray(each, np.float32 if real == "float" else np.float64) for each in equations(60))
    for value in (np.nan, -np.nan, np.inf, -np.inf):
        for place in range(A.size):
            bad = A.copy()
            bad.flat[place] = value
            with pytest.raises(InputError, match=f"`A` must be finite .*: row {place // 9} holds"):
                kernel.batch(bad, b)
    # the largest and the least numbers are finite
    limits = np.finfo(np.float32 if real == "float" else np.float64)
    kernel.batch(np.full_like(A, limits.max), np.full_like(b, -limits.max))
    kernel.batch(np.full_like(A, limits.smallest_subnormal), b)


def test_it_travels(kernel: Kernel) -> None:
    x, J, t = (each[0] for each in samples(1))
    copy = pickle.loads(pickle.dumps(kernel))
    assert copy.record.text == kernel.record.text
    assert [bits(result) for result in copy(x, J, t)] == [bits(result) for result in kernel(x, J, t)]
    assert "turning_leaf" in kernel.c_text
    assert copy.c_text == kernel.c_text


def test_interpreted_kernels_say_so_once(monkeypatch: pytest.MonkeyPatch) -> None:
    use_form("interpreted", monkeypatch)
    interpreted._warn_once.cache_clear()
    with pytest.warns(interpreted.CompilerMissing, match="No C compiler, says this test") as caught:
        _ = [make_kernel(each) for each in (turning(), doubled())]
    assert len(caught) == 1
