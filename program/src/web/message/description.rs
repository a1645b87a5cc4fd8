//! In: the messages' types. Out: their TypeScript declarations, which the pages' editors and tests use, and their JSON
//! schemas, from which clients are generated.
//! Frame and unit: none.

use super::*;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};
use ts_rs::TS;

/// Calls a macro with the name of every message.
macro_rules! of_every_message {
    ($call:ident) => {
        $call! {
            // The bar, job states and faults.
            Mode, RobotState, Frames, CalibrationAge, Lease, Bar, JobState, Problem,
            // Orders.
            Target, TeachOrder, Plain, ScanOrder, Filter, Filters, Filtered, FilterOrder, FindOrder, TouchOrder,
            CalibrateOrder, JointOrder, AutoOrder, InsertOrder, BenchmarkOrder, Order,
            // Results of orders, and the camera's state in them.
            CheckLine, ScanFigures, Notation, RobotPoses, Term, GateLight, Position, SurfaceTouched, SquareProposed,
            Touched, CalibrationFigures, Inserted, StripeSeen, PictureLook, ExposureSet, CameraFeature, CameraState,
            SetFeature, BenchRow, KeptUp, Outcome, Job,
            // The robot's motions, and events for viewers.
            Asked, SimulatedCell, MotionState, Arming, InTheCell, Event,
            // Sessions, the lease and confirmations.
            Knock, Session, TakeLease, Confirmed, Grant, Redeem,
            // The station: calibrations, settings, recordings.
            CalibrationState, FrameInfo, StationInfo, BackupInfo, Connection, SettingsState, SettingsAsk, OutputAsk,
            RecordingInfo, BoardView, ViewRef, SupportAsk, PictureRef,
            // Recipes and their drawings.
            RecipeText, RecipeAsk, PointsOf, RecipePoint, NewPoint, PointChange, PointsChange, PointsChanged,
            DrawingAsk, DrawingRead,
            // Viewing a scan and measuring in it.
            MapHead, Outlines, Ghost, SectionAsk, SectionPoint, Distance, Fit, Section, PointsAsk, PlaneAsk, Measure,
            MeasureAnswer,
            // Planned sweeps, and repeatability.
            SweepAsk, Pace, SweepPlan, RepeatsAsk, Spread, Repeats,
        }
    };
}

/// Content of `docs/messages.d.ts`; a test compares the file with this.
pub fn declarations() -> String {
    macro_rules! declared {
        ($($message:ident,)*) => { [$(format!("export {}", $message::decl())),*] };
    }
    format!(
        "// Made from program/src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.\n\n{}\n",
        of_every_message!(declared).join("\n\n")
    )
}

/// JSON schema of every message by its name, as `components.schemas` of an OpenAPI description holds them.
pub fn schemas() -> Map<String, Value> {
    let settings = SchemaSettings::draft2020_12().with(|s| s.definitions_path = "/components/schemas".into());
    let mut generator = settings.into_generator();
    macro_rules! described {
        ($($message:ident,)*) => { $(generator.subschema_for::<$message>();)* };
    }
    of_every_message!(described);
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
        let whole = with_what_it_refers_to(kind, schemas);
        schemas.insert(name, whole);
    }
    let schema = &mut schemas[message];
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
    for (key, value) in other["properties"].as_object().into_iter().flatten() {
        kind["properties"][key] = value.clone();
    }
    let mut required = kind["required"].as_array().cloned().unwrap_or_default();
    required.extend(other["required"].as_array().into_iter().flatten().cloned());
    kind["required"] = required.into();
    kind["type"] = "object".into();
    kind
}
