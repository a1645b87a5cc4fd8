//! In: nothing. Out: what a person chose of the station, changes of it, its backups, an output to try.
//! Frame and unit: as docs/file-formats.md says of each setting.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use ts_rs::TS;

/// The station's settings, and what belongs to it.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct SettingsState {
    /// station.toml as it lies there.
    pub text: String,
    /// SHA-256 of it: a change names the text that it was made from.
    pub sha256: String,
    /// Its settings by their names with dots; empty where the text cannot be read.
    #[ts(type = "Record<string, unknown>")]
    pub values: BTreeMap<String, serde_json::Value>,
    /// Notations that poses can be written in.
    pub notations: Vec<String>,
    /// The station's folder on the machine that serves the screen.
    pub folder: String,
    /// The folder below which recordings lie.
    pub recordings: String,
    /// Other machines may open the screen, with the password.
    pub secured: bool,
    /// Newest first.
    pub backups: Vec<BackupInfo>,
}

/// A backup that lies in the station's folder `backups`.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct BackupInfo {
    /// Its file.
    pub name: String,
    /// When it was made.
    pub created: String,
    /// Files of the station in it.
    pub files: usize,
    /// Bytes.
    #[ts(type = "number")]
    pub bytes: u64,
}

/// Changes of the settings: a whole text, or single settings; what cannot be is refused as a whole.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields, default)]
pub struct SettingsAsk {
    /// SHA-256 of the text that this was made from.
    pub sha256: String,
    /// A new station.toml.
    #[ts(optional = nullable)]
    pub text: Option<String>,
    /// Settings by their names with dots; null takes one out. Comments and all else stay.
    #[ts(type = "Record<string, unknown>")]
    pub changes: BTreeMap<String, serde_json::Value>,
}

/// An output of the controller to try.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct OutputAsk {
    /// line, pointer or room: lit for a moment; open or close: the gripper.
    pub output: String,
}
