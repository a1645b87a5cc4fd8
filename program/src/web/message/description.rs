//! In: the messages' types. Out: their TypeScript declarations, which the pages' editors and tests use, and their JSON
//! schemas, from which clients are generated.
//! Frame and unit: none.

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, SchemaGenerator};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use ts_rs::{TS, TypeVisitor};

/// How a message is described, with all that it consists of.
pub struct Message {
    declared: fn(&mut Declared),
    described: fn(&mut SchemaGenerator) -> schemars::Schema,
}

/// The description of one message.
pub const fn message<T: TS + JsonSchema + 'static>() -> Message {
    Message { declared: Declared::visit::<T>, described: SchemaGenerator::subschema_for::<T> }
}

/// TypeScript declarations by the names of their types.
#[derive(Default)]
struct Declared(BTreeMap<String, String>);

impl TypeVisitor for Declared {
    fn visit<T: TS + 'static + ?Sized>(&mut self) {
        // A type of the language itself has no file, and no declaration.
        if T::output_path().is_some() && !self.0.contains_key(&T::name()) {
            self.0.insert(T::name(), T::decl());
            T::visit_dependencies(self);
        }
    }
}

/// The messages' TypeScript declarations.
pub fn declarations(messages: &[Message]) -> String {
    let mut declared = Declared::default();
    messages.iter().for_each(|message| (message.declared)(&mut declared));
    let declared: Vec<String> = declared.0.values().map(|text| format!("export {text}")).collect();
    format!(
        "// Made from program/src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.\n\n{}\n",
        declared.join("\n\n")
    )
}

/// The messages' JSON schemas by their names.
pub fn schemas(messages: &[Message]) -> Map<String, Value> {
    let settings = SchemaSettings::draft2020_12().with(|s| s.definitions_path = "/components/schemas".into());
    let mut generator = settings.into_generator();
    for message in messages {
        (message.described)(&mut generator);
    }
    let mut schemas = generator.take_definitions(true);
    for name in schemas.keys().cloned().collect::<Vec<_>>() {
        name_kinds(&mut schemas, &name);
    }
    schemas
}

/// Gives each kind of a message a schema of its own, such as `OrderScan` for an `Order` with `"procedure": "scan"`:
/// clients name their types by the schemas' names. Words become an enumeration. Other messages stay as they are.
fn name_kinds(schemas: &mut Map<String, Value>, message: &str) {
    let Some(kinds) = schemas[message]["oneOf"].as_array().cloned() else { return };
    let words: Option<Vec<&str>> = kinds.iter().map(|kind| kind["const"].as_str()).collect();
    if let Some(words) = words {
        let said = kinds
            .iter()
            .zip(&words)
            .map(|(kind, word)| format!("{word}: {}", kind["description"].as_str().unwrap_or_default()));
        let said: Vec<String> =
            schemas[message]["description"].as_str().map(str::to_owned).into_iter().chain(said).collect();
        schemas[message] = json!({ "type": "string", "enum": words, "description": said.join("\n") });
        return;
    }
    // A kind may have kinds of its own, and values that all of these share.
    let common = schemas[message].clone();
    let tags: Option<Vec<Tag>> = kinds.iter().map(tag).collect();
    let Some(tags) = tags else { return };
    let (mut named, mut mapping) = (Vec::new(), Map::new());
    for (kind, Tag { word, .. }) in kinds.into_iter().zip(&tags) {
        let name = word.split('_').fold(message.to_owned(), |name, word| {
            let (first, rest) = word.split_at(1);
            name + &first.to_uppercase() + rest
        });
        let reference = format!("#/components/schemas/{name}");
        mapping.insert(word.clone(), reference.clone().into());
        named.push(json!({ "$ref": reference }));
        let whole = joined(with_what_it_refers_to(kind, schemas), &common);
        schemas.insert(name.clone(), whole);
        name_kinds(schemas, &name);
    }
    let schema = &mut schemas[message];
    for common in ["properties", "required", "type"] {
        schema.as_object_mut().map(|schema| schema.remove(common));
    }
    schema["oneOf"] = named.into();
    if let Some(key) = &tags[0].key {
        schema["discriminator"] = json!({ "propertyName": key, "mapping": mapping });
    }
}

/// What tells a kind of a message from the others.
struct Tag {
    word: String,
    /// The key that has this word as its value; `None`: the word is the kind's only key.
    key: Option<String>,
}

fn tag(kind: &Value) -> Option<Tag> {
    let properties = kind["properties"].as_object()?;
    let tagged = properties.iter().find_map(|(key, value)| Some((key, value["const"].as_str()?)));
    if let Some((key, word)) = tagged {
        return Some(Tag { word: word.to_owned(), key: Some(key.clone()) });
    }
    let [word] = properties.keys().collect::<Vec<_>>()[..] else { return None };
    Some(Tag { word: word.clone(), key: None })
}

/// A kind whose values are those of another schema as well, with these values in it.
fn with_what_it_refers_to(mut kind: Value, schemas: &Map<String, Value>) -> Value {
    let Some(other) = kind.as_object_mut().and_then(|kind| kind.remove("$ref")) else { return kind };
    let other = other.as_str().and_then(|path| schemas.get(path.rsplit('/').next()?)).cloned().unwrap_or_default();
    joined(kind, &other)
}

/// A kind with the values of another schema.
fn joined(mut kind: Value, other: &Value) -> Value {
    if let Some(values) = other["properties"].as_object() {
        values.iter().for_each(|(key, value)| kind["properties"][key] = value.clone());
        let mut required = kind["required"].as_array().cloned().unwrap_or_default();
        required.extend(other["required"].as_array().into_iter().flatten().cloned());
        kind["required"] = required.into();
        kind["type"] = "object".into();
    }
    kind
}
