//! In: the table of routes, the messages' schemas. Out: their description in OpenAPI 3.1, stored as docs/openapi.json.
//! Frame and unit: none.

use super::routes::{ROOT, Route, routes};
use crate::web::message::schemas;
use serde_json::{Map, Value, json};

/// The OpenAPI description, from which programs generate clients.
pub fn openapi() -> Value {
    let mut schemas = schemas();
    schemas.insert("Fault".into(), fault());
    let mut paths: Map<String, Value> = Map::new();
    for r in routes() {
        let path = format!("{ROOT}{}", r.path.replace("{*", "{"));
        let at = paths.entry(path).or_insert_with(|| json!({}));
        at[r.method.to_lowercase()] = operation(&r, &schemas);
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "sheetlight station",
            "version": "1",
            "description": "The operator's screen. Every request carries a session's cookie or 'Authorization: Bearer \
                            TOKEN', and 'X-Sheetlight-Tab' with a name of the caller's own where it operates.",
            "license": { "name": "MIT OR Apache-2.0" },
        },
        "paths": paths,
        "components": { "schemas": schemas, "securitySchemes": {
            "token": { "type": "http", "scheme": "bearer" },
            "session": { "type": "apiKey", "in": "cookie", "name": "sheetlight" },
        } },
        "security": [{ "token": [] }, { "session": [] }],
    })
}

/// Body of an answer that is not 2xx.
fn fault() -> Value {
    json!({
        "description": "Body of every answer with a status of 4xx or 5xx.",
        "type": "object",
        "properties": { "error": { "$ref": reference("Problem") } },
        "required": ["error"],
    })
}

fn reference(message: &str) -> String {
    format!("#/components/schemas/{message}")
}

fn parameter(name: &str, at: &str, required: bool, schema: Value) -> Value {
    json!({ "name": name, "in": at, "required": required, "schema": schema })
}

fn operation(r: &Route, schemas: &Map<String, Value>) -> Value {
    let names = r.path.split('/').filter_map(|w| w.strip_prefix('{')?.strip_suffix('}'));
    let string = || json!({ "type": "string" });
    let mut parameters: Vec<Value> =
        names.map(|n| parameter(n.trim_start_matches('*'), "path", true, string())).collect();
    if let Some(message) = r.takes.strip_prefix('?') {
        let required = schemas[message]["required"].as_array();
        let needs = |key: &str| required.is_some_and(|required| required.iter().any(|r| r == key));
        let properties = schemas[message]["properties"].as_object().expect("a query has named values");
        parameters.extend(properties.iter().map(|(k, schema)| parameter(k, "query", needs(k), schema.clone())));
    }
    if r.lease || r.path == "/lease" {
        parameters.push(parameter("X-Sheetlight-Tab", "header", true, string()));
    }
    let (kind, schema) = match r.gives {
        "" => ("application/json", json!({})),
        media if media.contains('/') => (media, json!({ "type": "string", "format": "binary" })),
        name => match name.strip_suffix("[]") {
            Some(item) => ("application/json", json!({ "type": "array", "items": { "$ref": reference(item) } })),
            None => ("application/json", json!({ "$ref": reference(name) })),
        },
    };
    let fault = json!({
        "description": "a fault",
        "content": { "application/json": { "schema": { "$ref": reference("Fault") } } },
    });
    let mut out = json!({
        "operationId": name(r),
        "summary": r.does,
        "parameters": parameters,
        "responses": { "4XX": fault, "5XX": fault },
    });
    for status in r.answers {
        out["responses"][status.to_string()] = match status {
            204 => json!({ "description": "none yet" }),
            _ => json!({ "description": "done", "content": { kind: { "schema": schema } } }),
        };
    }
    if !r.takes.is_empty() && !r.takes.starts_with('?') {
        out["requestBody"] = json!({
            "required": true,
            "content": { "application/json": { "schema": { "$ref": reference(r.takes) } } },
        });
    }
    if r.path == "/session" && r.method == "POST" {
        out["security"] = json!([]);
    }
    out
}

/// Name of an operation in clients: its method and its path's words.
fn name(r: &Route) -> String {
    let words = r.path.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.fold(r.method.to_lowercase(), |name, word| format!("{name}_{word}"))
}
