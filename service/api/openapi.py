"""The OpenAPI document, and a page that shows it without internet access."""

from __future__ import annotations

import base64
import hashlib
import re
from html import escape
from threading import Lock
from typing import Any

from fastapi import APIRouter, FastAPI, Request
from fastapi.openapi.utils import get_openapi
from fastapi.responses import HTMLResponse, JSONResponse
from pydantic import BaseModel

from service.api.errors import problem_responses
from service.api.examples import add_examples
from service.api.guard import is_limited, is_open
from service.wire.operations import ProblemOut
from service.wire.proofs import ProofOut
from service.wire.sites import TargetCatalogIn
from service.wire.timelines import TimelineOut

router = APIRouter(include_in_schema=False)

# Schemas that no route's signature mentions.
_FURTHER_SCHEMAS: dict[str, type[BaseModel]] = {
    "Problem": ProblemOut,
    "TargetCatalogIn": TargetCatalogIn,
    "Timeline": TimelineOut,
    "Proof": ProofOut,
}

_SENTENCE = re.compile(r"(.+?)\.(?:\s+|$)(.*)", re.DOTALL)
_CREATING = ("200", "201", "202")
_ALWAYS = (422, 500, 503)
_WITH_BODY = (413, 415)
# Headers of all answers and of these statuses, and the request headers that lead to the latter.
_ON_EVERY_ANSWER = {"X-Request-ID": "Identifies this request in logs and problem documents."}
_ANSWER_HEADERS = {
    "201": {"Location": "URL of the created object.", "ETag": "Its current version."},
    "202": {"Location": "URL of its status.", "Retry-After": "Seconds to wait before asking."},
    "304": {"ETag": "Its current version."},
    "412": {"ETag": "Its current version."},
    "503": {"Retry-After": "Seconds to wait before asking again, if known."},
}
_CONDITIONS = {
    "304": ("If-None-Match", "ETags that the client has: 304 if one is the current version."),
    "412": ("If-Match", "The ETag that the object must still have: 412 if it has changed."),
}
_WITH_KEY = (401, 403, 503)
_LIMITED = (429,)
_KEYS = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "A key of the service."},
    "header": {
        "type": "apiKey",
        "in": "header",
        "name": "X-API-Key",
        "description": "The same, for clients that cannot set Authorization.",
    },
}


def install_openapi(app: FastAPI) -> None:
    """Make ``app.openapi()`` return the document with every error response declared.

    Building it takes seconds, once: call it only in a thread.
    """
    building = Lock()

    def document() -> dict[str, Any]:
        with building:
            if app.openapi_schema is None:
                app.openapi_schema = _with_problems(
                    get_openapi(
                        title=app.title,
                        version=app.version,
                        description=app.description,
                        routes=app.routes,
                    )
                )
            return app.openapi_schema

    # As FastAPI's documentation recommends.
    app.openapi = document  # type: ignore[method-assign]


def _with_problems(document: dict[str, Any]) -> dict[str, Any]:
    schemas = document.setdefault("components", {}).setdefault("schemas", {})
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    for name, model in _FURTHER_SCHEMAS.items():
        schema = model.model_json_schema(ref_template="#/components/schemas/{model}")
        schemas |= schema.pop("$defs", {})
        schemas[name] = schema | {"title": name}
    document["components"]["securitySchemes"] = _KEYS
    for path, operations in document["paths"].items():
        for operation in operations.values():
            _summarise(operation)
            statuses = _ALWAYS + (_WITH_BODY if "requestBody" in operation else ())
            statuses += _LIMITED if is_limited(path) else ()
            if not is_open(path):
                statuses += _WITH_KEY
                operation["security"] = [{name: []} for name in _KEYS]
            for status, response in problem_responses(*statuses).items():
                operation["responses"][str(status)] = response
            for status, (header, description) in _CONDITIONS.items():
                if status in operation["responses"]:
                    operation.setdefault("parameters", []).append(
                        {"name": header, "in": "header", "required": False, **_text(description)}
                    )
            for status, response in operation["responses"].items():
                told = _ON_EVERY_ANSWER | _ANSWER_HEADERS.get(status, {})
                headers = {name: _text(description) for name, description in told.items()}
                response["headers"] = headers | response.get("headers", {})
    add_examples(document)
    _add_links(document)
    return document


def _summarise(operation: dict[str, Any]) -> None:
    """Replace the summary, a function's name, with the first sentence of the description."""
    if found := _SENTENCE.match(operation.get("description", "")):
        first, rest = found.groups()
        operation["summary"] = " ".join(first.split())
        operation["description"] = rest or f"{first}."


def _add_links(document: dict[str, Any]) -> None:
    """Link each creating call to every call that needs only the id of what was created."""
    paths = document["paths"]
    for path, operations in paths.items():
        if "post" not in operations:
            continue
        links = {
            operation["operationId"]: {
                "operationId": operation["operationId"],
                "parameters": {parameter: "$response.body#/id"},
                "description": operation.get("summary", ""),
            }
            for below, parameter in _below(path, paths)
            for operation in paths[below].values()
        }
        for status, response in operations["post"]["responses"].items():
            if links and status in _CREATING:
                response["links"] = links


def _below(collection: str, paths: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the paths of one item of a collection, each with the name of the id's parameter."""
    found = []
    for path in paths:
        root, slot, _ = path.partition("/{")
        if slot and root == collection and path.count("{") == 1:
            found.append((path, path[path.index("{") + 1 : path.index("}")]))
    return found


def _text(description: str) -> dict[str, Any]:
    return {"description": description, "schema": {"type": "string"}}


@router.get("/openapi.json", name="openapi")
def openapi_json(request: Request) -> JSONResponse:
    """Return the document. FastAPI's own route would build it in the event loop."""
    return JSONResponse(request.app.openapi())


@router.get("/docs", response_class=HTMLResponse)
def docs(request: Request) -> HTMLResponse:
    """Return the list of all calls as one page of plain HTML."""
    document = request.app.openapi()
    parts = [
        _operation(method, path, operation)
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
    ]
    models = [
        f"<details id='{escape(name)}'><summary><code>{escape(name)}</code></summary>"
        f"{_fields(schema)}</details>"
        for name, schema in sorted(document["components"]["schemas"].items())
    ]
    page = _PAGE.format(
        style=_STYLE,
        script=_SCRIPT,
        **{name: escape(text) for name, text in document["info"].items()},
        operations="\n".join(parts),
        models="\n".join(models),
    )
    return HTMLResponse(page, headers={"Content-Security-Policy": _PAGE_POLICY})


def _operation(method: str, path: str, operation: dict[str, Any]) -> str:
    parameters = "".join(
        f"<tr><td><code>{escape(p['name'])}</code></td><td>{p['in']}</td>"
        f"<td>{_type(p.get('schema', {}))}</td><td>{escape(p.get('description', ''))}</td></tr>"
        for p in operation.get("parameters", [])
    )
    body = "".join(
        f"<li><code>{escape(kind)}</code> {_type(content.get('schema', {}))}</li>"
        for kind, content in operation.get("requestBody", {}).get("content", {}).items()
    )
    answers = "".join(
        f"<li><code>{status}</code> {escape(response['description'])}"
        + "".join(
            f" {_type(content.get('schema', {}))}"
            for content in response.get("content", {}).values()
        )
        + "</li>"
        for status, response in sorted(operation["responses"].items())
    )
    return (
        f"<details><summary><b>{method.upper()}</b> <code>{escape(path)}</code> "
        f"{escape(operation.get('summary', ''))}</summary>"
        f"<p>{escape(operation.get('description', ''))}</p>"
        + (f"<table>{parameters}</table>" if parameters else "")
        + (f"<p>Body</p><ul>{body}</ul>" if body else "")
        + f"<p>Answers</p><ul>{answers}</ul></details>"
    )


def _fields(schema: dict[str, Any]) -> str:
    required = set(schema.get("required", []))
    rows = "".join(
        f"<tr><td><code>{escape(name)}</code></td><td>{_type(field)}</td>"
        f"<td>{'required' if name in required else _default(field)}</td>"
        f"<td>{escape(field.get('description', ''))}</td></tr>"
        for name, field in schema.get("properties", {}).items()
    )
    return f"<p>{escape(schema.get('description', ''))}</p><table>{rows}</table>"


def _default(field: dict[str, Any]) -> str:
    return f"default <code>{escape(str(field['default']))}</code>" if "default" in field else ""


def _type(schema: dict[str, Any]) -> str:
    if "$ref" in schema:
        name = escape(schema["$ref"].rpartition("/")[2])
        return f"<a href='#{name}'>{name}</a>"
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return " or ".join(_type(option) for option in schema[key])
    if schema.get("type") == "array":
        return f"list of {_type(schema.get('items', {}))}"
    if "enum" in schema or "const" in schema:
        return " or ".join(escape(repr(v)) for v in schema.get("enum", [schema.get("const")]))
    return escape(str(schema.get("format") or schema.get("type", "any")))


_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto;
  padding: 0 1rem; }
summary { cursor: pointer; padding: .3rem 0; }
details { border-bottom: 1px solid #8884; }
td { padding: .1rem 1rem .1rem 0; vertical-align: top; }
"""

_SCRIPT = """
const show = () => { const d = document.getElementById(location.hash.slice(1));
  if (d) d.open = true; };
addEventListener("hashchange", show); show();
"""

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title} {version}: the HTTP API</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>{style}</style></head><body>
<h1>{title} {version}</h1><p>{description}</p>
<p>The same in machine-readable form: <a href="/openapi.json">/openapi.json</a> (OpenAPI 3.1).</p>
<h2>Calls</h2>
{operations}
<h2>Shapes</h2>
{models}
<script>{script}</script>
</body></html>"""


def _hash_of(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


# The page may run its own script and style, by their hashes, and nothing else.
_PAGE_POLICY = (
    f"default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; "
    f"style-src {_hash_of(_STYLE)}; script-src {_hash_of(_SCRIPT)}"
)
