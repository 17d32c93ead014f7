"""Validation messages: what people read when a file does not fit its pydantic model, every fault at once."""

import difflib
from typing import Any

from pydantic import BaseModel, ValidationError

_BRANCHES = frozenset({"str", "datetime"})  # pydantic names the alternative it tried as if it were an entry
_SIGNS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
_KINDS = {"boolean": "true or false", "string": "a text", "array": "a list", "object": "a table"}


def sentences(model: type[BaseModel], refused: ValidationError) -> list[str]:
    """Return one sentence for each wrong entry: its full name, what is allowed, what stands there or is meant."""
    schema = model.model_json_schema()
    found = []
    for error in refused.errors():
        path = [part for part in error["loc"] if part not in _BRANCHES]
        where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")
        if error["type"] == "extra_forbidden":
            found.append(f"`{where}` is no known entry.{_meant(schema, path)}")
        elif error["type"] == "missing":
            found.append(f"`{where}` is missing; it must be {_allowed(_node(schema, path))}.")
        else:
            node, given = _node(schema, path), error["input"]
            found.append(f"`{where}` must be {_allowed(node)}, got {_shown(given)}.{_meant_word(node, given)}")
    return list(dict.fromkeys(found))


def _meant(schema: dict[str, Any], path: list[int | str]) -> str:
    """Return the nearest entry of the same table, else the table that has an entry of this name, else all entries."""
    name, here = str(path[-1]), list(_node(schema, path[:-1])["properties"])
    near = difflib.get_close_matches(name, here, n=1, cutoff=0.6)
    tables = schema.get("$defs", {})
    others = [
        f"{title}.{name}"
        for title, entry in schema["properties"].items()
        if name in tables.get(_reference(entry), {}).get("properties", {})
    ]
    nearest = near or others
    return f" Did you mean `{nearest[0]}`?" if nearest else f" Known here: {', '.join(here)}."


def _node(schema: dict[str, Any], path: list[int | str]) -> dict[str, Any]:
    """Return the part of a JSON schema that describes the entry at `path`."""
    node = schema
    for part in path:
        node = node["items"] if isinstance(part, int) else node["properties"][part]
        if reference := _reference(node):
            node = schema["$defs"][reference]
    return node


def _reference(entry: dict[str, Any]) -> str:
    """Return the name of the table that an entry, an optional entry or a list holds; empty for a plain value."""
    for candidate in (entry, *entry.get("anyOf", ())):
        if "$ref" in candidate:
            return str(candidate["$ref"]).rpartition("/")[2]
    return ""


def _allowed(node: dict[str, Any]) -> str:
    if "const" in node:
        return f'"{node["const"]}"'
    if "enum" in node:
        return "one of " + ", ".join(f'"{word}"' for word in node["enum"])
    if node.get("type") == "array" and (count := node.get("minItems")) == node.get("maxItems") is not None:
        return f"a list of {count} numbers"
    if node.get("anyOf"):
        node = {**node["anyOf"][0], **{key: node[key] for key in _SIGNS if key in node}}
    if node.get("type") not in ("number", "integer"):
        return _KINDS.get(node.get("type", ""), "a value")
    limits = [f"{sign} {node[key]:g}" for key, sign in _SIGNS.items() if key in node]
    number = "a whole number" if node["type"] == "integer" else "a number"
    return " ".join([number, " and ".join(limits)]).strip()


def _meant_word(node: dict[str, Any], given: object) -> str:
    near = difflib.get_close_matches(str(given), node.get("enum", ()), n=1, cutoff=0.6)
    return f' Did you mean "{near[0]}"?' if near else ""


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
