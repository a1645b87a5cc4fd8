//! In: nothing. Out: a station's settings, changes to them, its backups, an output to try.
//! Frame and unit: as docs/file-formats.md states for each setting.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use ts_rs::TS;

/// The station's settings, and related data.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct SettingsState {
    /// The text of station.toml.
    pub text: String,
    /// SHA-256 of the text: a change names the text that it was made from.
    pub sha256: String,
    /// The settings by their dotted names; empty if the text cannot be read.
    #[ts(type = "Record<string, unknown>")]
    pub values: BTreeMap<String, serde_json::Value>,
    /// Available pose conventions.
    pub notations: Vec<String>,
    /// The station's folder on the machine that serves the screen.
    pub folder: String,
    /// The folder that contains the recordings.
    pub recordings: String,
    /// Other machines may open the screen, with the password.
    pub secured: bool,
    /// Links to other programs that were named when the program was started.
    pub connections: Vec<Connection>,
    /// Newest first.
    pub backups: Vec<BackupInfo>,
}

/// A link to another program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS, JsonSchema)]
pub struct Connection {
    /// mqtt: this program connects to a broker; modbus: PLCs connect to it.
    pub door: String,
    /// Address of the broker, or the address that is listened on.
    pub address: String,
    /// Why the door is not open; null if it is.
    pub problem: Option<String>,
    /// The other programs that are connected now.
    pub peers: Vec<String>,
    /// Messages that were handed over, or frames that were answered, since the start.
    #[ts(type = "number")]
    pub sent: u64,
    /// Messages that were not, because too many waited; frames, requests and connections that were refused.
    #[ts(type = "number")]
    pub lost: u64,
    /// Growth of `sent` over the last ten seconds, 1/s.
    pub rate_hz: f64,
    /// The last problem or refusal; null if there was none.
    pub last_error: Option<String>,
}

/// A backup in the station's folder `backups`.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct BackupInfo {
    /// Name of its file.
    pub name: String,
    /// When it was made.
    pub created: String,
    /// Number of the station's files in it.
    pub files: usize,
    /// Size in bytes.
    #[ts(type = "number")]
    pub bytes: u64,
}

/// Changes to the settings: a whole text, or single settings. If one change is invalid, none is made.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SettingsAsk {
    /// SHA-256 of the text that this change was made from.
    pub sha256: String,
    /// A new station.toml.
    #[ts(optional = nullable)]
    pub text: Option<String>,
    /// Settings by their dotted names; null removes one. Comments and all other settings stay.
    #[ts(type = "Record<string, unknown>")]
    pub changes: BTreeMap<String, serde_json::Value>,
}

/// An output of the controller to try.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputAsk {
    /// line, pointer or room: on for a moment; open or close: the gripper.
    pub output: String,
}
