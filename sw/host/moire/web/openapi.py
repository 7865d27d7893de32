# SPDX-License-Identifier: Apache-2.0
"""The OpenAPI document of the doors, and a page for people, both made from the table in api.py."""

import re
from collections.abc import Mapping
from html import escape
from importlib.metadata import version
from typing import Any

from moire.web.access import TOKEN_BYTES
from moire.web.api import OPERATIONS
from moire.web.operation import Given, Operation
from moire.web.stream import WISHES

SCHEMAS: Mapping[str, dict[str, Any]] = {  # of the types that the table names
    "text": {"type": "string"},
    "length": {"type": "string"},
    "time": {"type": "string"},
    "value": {"type": ["string", "number"]},
    "flag": {"type": "boolean"},
    "whole number": {"type": "integer"},
    "number": {"type": "number"},
    "text or null": {"type": ["string", "null"]},
    "flag or null": {"type": ["boolean", "null"]},
    "number or null": {"type": ["number", "null"]},
    "whole number or null": {"type": ["integer", "null"]},
    "list of texts or null": {"type": ["array", "null"], "items": {"type": "string"}},
    "list of texts": {"type": "array", "items": {"type": "string"}},
    "list": {"type": "array", "items": {"type": "object"}},
    "list of numbers": {"type": "array", "items": {"type": "number"}},
    "map of lists": {
        "type": "object",
        "additionalProperties": {"type": "array", "items": {"type": "number"}},
    },
    "map of numbers or null": {
        "type": ["object", "null"],
        "additionalProperties": {"type": "number"},
    },
    "map of texts": {"type": "object", "additionalProperties": {"type": "string"}},
}
ERROR = {
    "cause": "a name for programs, such as other_client",
    "text": "what is wrong, in one sentence",
    "to_do": "what to do about it",
    "owner": "with the cause other_client: who moves the axis",
}
SUMMARY = (
    'Lengths and all other quantities are texts with their unit, such as "1.5 mm". Answers have '
    'the unit in the name of each field. Every error is {"error": {"cause", "text", '
    '"to_do"}}. A connection is a client: what it moves is stopped when it closes. With the '
    "header Moire-Client: NAME, all connections with this name are one client, which has left "
    "when it has asked nothing for 5 s."
)


def document() -> dict[str, Any]:
    """The document of OpenAPI 3.1."""
    paths: dict[str, dict[str, Any]] = {}
    for operation in OPERATIONS:
        paths.setdefault(operation.path, {})[operation.method.lower()] = described(operation)
    error = {
        "type": "object",
        "properties": {
            "error": {
                "type": "object",
                "properties": {
                    name: {"type": "string", "description": text} for name, text in ERROR.items()
                },
                "required": [name for name in ERROR if name != "owner"],
            }
        },
        "required": ["error"],
    }
    token = {
        "type": "http",
        "scheme": "bearer",
        "description": f"needed on other addresses than the loopback one; {TOKEN_BYTES} bytes",
    }
    return {
        "openapi": "3.1.0",
        "info": {"title": "Moire", "version": version("moire"), "description": SUMMARY},
        "paths": paths,
        "components": {"schemas": {"Error": error}, "securitySchemes": {"token": token}},
        "security": [{}, {"token": []}],
    }


def described(operation: Operation) -> dict[str, Any]:
    """One operation."""
    known: dict[str, Any] = {
        "operationId": operation.name,
        "summary": operation.what,
        "parameters": [
            {
                "name": name,
                "in": "path",
                "required": True,
                "schema": {"type": "string" if name == "name" else "integer"},
            }
            for name in re.findall(r"{(\w+)}", operation.path)
        ],
        "responses": {
            "200": {"description": "done", "content": content(object_of(operation))},
            "default": {
                "description": "refused",
                "content": content({"$ref": "#/components/schemas/Error"}),
            },
        },
    }
    if operation.given and not operation.changes:
        known["parameters"] += [{**field_of(one), "in": "query"} for one in operation.given]
    elif operation.given:
        body = {
            "type": "object",
            "properties": {
                one.name: {**SCHEMAS[one.kind], "description": one.what, "examples": [one.example]}
                for one in operation.given
            },
            "required": [one.name for one in operation.given if one.required],
            "additionalProperties": False,
        }
        known["requestBody"] = {"content": content(body)}
    return known


def content(schema: Mapping[str, Any]) -> dict[str, Any]:
    """A body of JSON."""
    return {"application/json": {"schema": schema}}


def field_of(one: Given) -> dict[str, Any]:
    """A field of a query."""
    return {
        "name": one.name,
        "required": one.required,
        "description": one.what,
        "schema": SCHEMAS[one.kind],
        "example": one.example,
    }


def object_of(operation: Operation) -> dict[str, Any]:
    """The answer of an operation."""
    properties = {
        name: {**SCHEMAS[kind], "description": text}
        for name, (kind, text) in operation.answer.items()
    }
    return {"type": "object", "properties": properties, "required": list(properties)}


# ------------------------------------------------------------------ for people

STYLE = """body { font: 16px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 60em;
padding: 0 1em; color-scheme: light dark; } code { font-size: 95%; } dt { margin-top: 1em; }
.method { display: inline-block; min-width: 4em; font-weight: bold; }"""


def page() -> str:
    """The operations as a page of HTML."""
    rows = "\n".join(
        f"<dt><code><span class=method>{one.method}</span> {escape(one.path)}</code></dt>"
        f"<dd>{escape(one.what)}{fields_of(one.given)}</dd>"
        for one in OPERATIONS
    )
    return f"""<!doctype html>
<html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<title>Moire: what this server can be asked for</title><style>{STYLE}</style>
<h1>What this server can be asked for</h1>
<p>{escape(SUMMARY)}</p>
<p>The same for programs: <a href=/api/openapi.json>/api/openapi.json</a> (OpenAPI 3.1).</p>
<dl>
{rows}
<dt><code><span class=method>WS</span> /api/stream</code></dt>
<dd>Samples of axes, and any of these requests, over one WebSocket. In its query or in a message
<code>{{"stream": {{…}}}}</code>:{fields_of(WISHES)}
A request is a message <code>{{"id": 1, "method": "POST", "path":
"/api/nodes/1/axes/0/stop"}}</code>, with its fields in <code>"body"</code>.</dd>
</dl>
"""


def fields_of(given: tuple[Given, ...]) -> str:
    """The fields of a request, as a list; the many names of the parameters are not listed."""
    if not given or len(given) > 10:
        return ""
    rows = "".join(
        f"<li><code>{one.name}</code>: {escape(one.what)}, such as "
        f"<code>{escape(str(one.example))}</code></li>"
        for one in given
    )
    return f"<ul>{rows}</ul>"
