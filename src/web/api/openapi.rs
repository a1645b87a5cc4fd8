//! In: the table of routes, the messages' declarations. Out: their description in OpenAPI 3.1, stored as
//! docs/openapi.json.
//! Frame and unit: none.

use super::routes::{ROOT, Route, routes};
use serde_json::{Map, Value, json};

/// The OpenAPI description. It names messages by `x-message`; docs/messages.d.ts declares them.
pub fn openapi() -> Value {
    let mut paths: Map<String, Value> = Map::new();
    for r in routes() {
        let path = format!("{ROOT}{}", r.path.replace("{*", "{"));
        let at = paths.entry(path).or_insert_with(|| json!({}));
        at[r.method.to_lowercase()] = operation(&r);
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "sheetlight station",
            "version": "1",
            "description": "The operator's screen. Messages are declared in docs/messages.d.ts. Every request \
                            carries a session's cookie or 'Authorization: Bearer TOKEN', and 'X-Sheetlight-Tab' \
                            with a name of the caller's own where it operates. Faults: {\"error\": Problem}.",
            "license": { "name": "MIT OR Apache-2.0" },
        },
        "paths": paths,
        "components": { "securitySchemes": {
            "token": { "type": "http", "scheme": "bearer" },
            "session": { "type": "apiKey", "in": "cookie", "name": "sheetlight" },
        } },
        "security": [{ "token": [] }, { "session": [] }],
    })
}

fn operation(r: &Route) -> Value {
    let names = r.path.split('/').filter_map(|w| w.strip_prefix('{')?.strip_suffix('}'));
    let mut parameters: Vec<Value> = names
        .map(|n| {
            json!({ "name": n.trim_start_matches('*'), "in": "path", "required": true,
            "schema": { "type": "string" } })
        })
        .collect();
    if let Some(message) = r.takes.strip_prefix('?') {
        parameters
            .push(json!({ "name": "query", "in": "query", "schema": { "type": "object", "x-message": message } }));
    }
    if r.lease {
        parameters.push(
            json!({ "name": "X-Sheetlight-Tab", "in": "header", "required": true, "schema": { "type": "string" } }),
        );
    }
    let (kind, schema) = match r.gives {
        "" => ("application/json", json!({})),
        media if media.contains('/') => (media, json!({ "type": "string", "format": "binary" })),
        name => match name.strip_suffix("[]") {
            Some(item) => {
                ("application/json", json!({ "type": "array", "items": { "type": "object", "x-message": item } }))
            }
            None => ("application/json", json!({ "type": "object", "x-message": name })),
        },
    };
    let problem = json!({ "schema": { "x-message": "Problem" } });
    let fault = json!({ "description": "a fault", "content": { "application/json": problem } });
    let mut out = json!({
        "summary": r.does,
        "parameters": parameters,
        "responses": { "200": { "description": "done", "content": { kind: { "schema": schema } } }, "4XX": fault },
    });
    if !r.takes.is_empty() && !r.takes.starts_with('?') {
        out["requestBody"] =
            json!({ "content": { "application/json": { "schema": { "type": "object", "x-message": r.takes } } } });
    }
    if r.path == "/session" && r.method == "POST" {
        out["security"] = json!([]);
    }
    out
}
