//! In: nothing. Out: a station's settings, changes to them, its backups, an output to try.
//! Frame and unit: as docs/file-formats.md states for each setting.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use ts_rs::TS;

/// The station's settings, and related data.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
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
    /// Newest first.
    pub backups: Vec<BackupInfo>,
}

/// A backup in the station's folder `backups`.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
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
#[derive(Clone, Debug, Default, PartialEq, Deserialize, TS)]
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
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct OutputAsk {
    /// line, pointer or room: on for a moment; open or close: the gripper.
    pub output: String,
}
