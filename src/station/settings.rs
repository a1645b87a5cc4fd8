//! In: `station.toml`, which a person writes. Out: names, working volume, extraction settings, limits.
//! Frame and unit: camera frame for the working volume, mm; docs/file-formats.md lists every key.

use crate::arm::{Outputs, rules::Limits};
use crate::calibrate::hand_eye::options::Mount;
use crate::fault::{Fault, Result};
use crate::geometry::{Flange, Rigid, Tool, Vec3};
use crate::rig::Volume;
use crate::robot::Convention;
use std::path::Path;

/// The settings of a station that a person decides. Unknown keys are refused.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// A name for display on pages and in files.
    pub name: String,
    /// The notation of this station's robot; needed only where poses are printed for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<Convention>,
    /// Whether the camera is on the flange or stands still; it determines which camera pose is calibrated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mount: Option<Mount>,
    /// Tolerance of the work, mm, by which calibrations are judged. Without it a share of the camera's view is
    /// used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance_mm: Option<f64>,
    /// The working volume; without it, it follows from the depths of the boards in the laser plane's calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub working_volume: Option<WorkingVolume>,
    /// The limits of every motion of the robot; without them nothing is moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Limits>,
    /// The devices on the controller's outputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Outputs>,
    /// The pose of the gripper's tool on the flange.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool: Option<ToolSpec>,
    /// The sensor head on the flange; without it the hand-eye calibration gives its position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub head: Option<HeadSpec>,
    /// How the stripe is found; docs/file-formats.md lists every key.
    pub extraction: crate::scan::Extraction,
}

/// The pose of the inserting tool.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolSpec {
    /// Flange from tool, 16 numbers row by row, mm. The tool's origin goes to the part's origin; its z points
    /// against the insertion.
    pub flange_from_tool: Rigid<Flange, Tool>,
}

/// The sensor head on the flange.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadSpec {
    /// Its outermost points in the flange's frame, mm, at most 2000 from the flange. Every motion limits their
    /// speed and keeps them out of keep-outs. Empty: nothing of the sensor is on the flange.
    pub points_mm: Vec<[f64; 3]>,
}

/// Largest accepted distance of a point from the flange, mm.
const LEVER: f64 = 2000.0;

/// The range of parts: camera-frame depths between which the laser plane is accepted.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorkingVolume {
    /// Nearest depth along the optical axis, mm, > 0.
    pub near_mm: f64,
    /// Farthest depth, mm, > near. Pixels whose ray meets the sheet outside these depths are ignored.
    pub far_mm: f64,
}

/// Smallest and largest accepted `far_mm`; values outside look like metres or micrometres.
const METRES: f64 = 3.0;
const MICROMETRES: f64 = 50_000.0;
/// Accepted tolerance, mm: from a micrometre to a hand's breadth.
const FINEST: f64 = 1e-3;
const COARSEST: f64 = 100.0;

impl Settings {
    /// Reads `station/station.toml`; a station without one has the defaults.
    pub fn load(station: &Path) -> Result<Settings> {
        let path = station.join("station.toml");
        let text = match crate::files::read_text_if_there(&path)? {
            Some(text) => text,
            None if station.is_dir() => return Ok(Settings::default()),
            None => {
                return Err(Fault::read(&path, std::io::ErrorKind::NotFound.into())
                    .next("make a station with sheetlight station new, or give its folder as --station"));
            }
        };
        Settings::parse(&text).map_err(|e| e.at(path.display()))
    }

    /// Parses the text of a station.toml and checks it.
    ///
    /// # Errors
    /// Unknown keys, and what [`Settings::check`] refuses.
    pub fn parse(text: &str) -> Result<Settings> {
        let settings: Settings = toml::from_str(text).map_err(|e| {
            let place = e.span().map_or(0, |s| s.start);
            let (cause, next) = match below_a_section(text, place) {
                Some(key) => (
                    format!("{key} stands below a [section] line, so TOML counts it to that section"),
                    format!("move {key} above the first line that begins with ["),
                ),
                None => (
                    crate::files::slip_at(text, place, "a misspelt key or a value of the wrong type").into(),
                    "compare it with docs/file-formats.md, or with what sheetlight station new writes".into(),
                ),
            };
            Fault::input(format!("is not a station file: {}", e.to_string().trim_end())).cause(cause).next(next)
        })?;
        settings.check()?;
        Ok(settings)
    }

    /// Refuses values out of range, and lengths that look like another unit than mm.
    pub fn check(&self) -> Result<()> {
        if let Some(v) =
            self.working_volume.filter(|v| !(v.near_mm > 0.0 && v.far_mm > v.near_mm && v.far_mm.is_finite()))
        {
            return Err(Fault::input(format!(
                "working_volume runs from near_mm = {} to far_mm = {}; 0 < near_mm < far_mm is needed",
                v.near_mm, v.far_mm
            ))
            .cause("swapped, or metres instead of millimetres")
            .next("give the camera's nearest and farthest working distance in millimetres"));
        }
        if let Some(v) = self.working_volume.filter(|v| v.far_mm < METRES || v.far_mm > MICROMETRES) {
            let unit = if v.far_mm < METRES { "metres" } else { "micrometres" };
            return Err(Fault::input(format!(
                "working_volume runs from near_mm = {} to far_mm = {}, which looks like {unit}",
                v.near_mm, v.far_mm
            ))
            .cause(format!("{unit} instead of millimetres"))
            .next("give the camera's nearest and farthest working distance in millimetres"));
        }
        if let Some(mm) = self.tolerance_mm.filter(|mm| !(*mm > 0.0 && mm.is_finite())) {
            return Err(Fault::input(format!("tolerance_mm is {mm}, a length above 0 mm is needed"))
                .next("give the tolerance in millimetres, or remove the key"));
        }
        if let Some(mm) = self.tolerance_mm.filter(|mm| !(FINEST..=COARSEST).contains(mm)) {
            let unit = if mm < FINEST { "metres" } else { "micrometres" };
            return Err(Fault::input(format!(
                "tolerance_mm is {mm}, which looks like {unit}; {FINEST} to {COARSEST} is accepted"
            ))
            .cause(format!("{unit} instead of millimetres"))
            .next("give the tolerance in millimetres, or remove the key"));
        }
        let head = self.head.iter().flat_map(|h| &h.points_mm).map(|p| ("head.points_mm", Vec3::from(*p)));
        let tool = self.tool.iter().map(|t| ("tool.flange_from_tool", t.flange_from_tool.translation));
        if let Some((name, p)) = head.chain(tool).find(|(_, p)| !(p.norm() <= LEVER)) {
            return Err(Fault::input(format!(
                "{name}: a point lies {:.0} mm from the flange, at most {LEVER} is accepted",
                p.norm()
            ))
            .cause("another unit than millimetres, or a point that is not in the flange's frame")
            .next("give it in millimetres from the flange's middle"));
        }
        self.motion.as_ref().map_or(Ok(()), Limits::check)?;
        self.extraction.check()
    }

    /// The stated depths.
    pub fn volume(&self) -> Option<Volume> {
        self.working_volume.map(|v| Volume::new(v.near_mm, v.far_mm, "station.toml"))
    }

    /// Writes `station/station.toml`. Keys that are worth setting and were left out stand there as comments.
    pub fn store(&self, station: &Path) -> Result<()> {
        crate::files::make_folder(station)?;
        let text = toml::to_string(self).expect("plain data");
        let first_section = text.find("\n[").map_or(text.len(), |at| at + 1);
        let (keys, sections) = text.split_at(first_section);
        let tolerance = if self.tolerance_mm.is_none() { TOLERANCE } else { "" };
        let volume = if self.working_volume.is_none() { VOLUME } else { "" };
        let text = format!("{}{tolerance}{volume}\n{sections}", keys.trim_end_matches('\n').to_owned() + "\n");
        crate::files::write(&station.join("station.toml"), text.as_bytes())
    }
}

const TOLERANCE: &str = "
# What your work tolerates, mm. Calibrations are judged by it; without it by 0.15 % of the camera's view.
# tolerance_mm = 0.2
";
const VOLUME: &str = "
# Nearest and farthest distance from the camera to a part, mm. Without them the depths of the calibration boards count.
# [working_volume]
# near_mm = 100.0
# far_mm = 300.0
";

/// The keys that stand above all sections.
const TOP: [&str; 4] = ["name", "robot", "mount", "tolerance_mm"];

/// The key at this place of a station.toml, if it belongs above all sections and stands below one.
fn below_a_section(text: &str, place: usize) -> Option<&'static str> {
    let (before, rest) = (text.get(..place)?, text.get(place..)?);
    let within = before.lines().any(|line| line.trim_start().starts_with('['));
    let word: String = rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    TOP.into_iter().find(|key| within && *key == word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_keys_and_swapped_volumes_are_refused() {
        assert!(Settings::parse("name = 'a'").is_ok());
        assert!(Settings::parse("nam = 'a'").unwrap_err().what.contains("nam"));
        let below = Settings::parse("[extraction]\nspacing = 1.5\ntolerance_mm = 0.1").unwrap_err();
        assert!(below.cause.contains("below a [section]") && below.next.contains("move tolerance_mm"), "{below}");
        assert!(Settings::parse("[working_volume]\nnear_mm = 300\nfar_mm = 100").is_err());
        assert!(Settings::parse("tolerance_mm = 0").unwrap_err().what.contains("tolerance_mm"));
        let metres = Settings::parse("[working_volume]\nnear_mm = 0.06\nfar_mm = 0.32").unwrap_err();
        assert!(metres.what.contains("looks like metres"), "{metres}");
        assert!(Settings::parse("tolerance_mm = 0.0001").unwrap_err().what.contains("looks like metres"));
        assert!(Settings::parse("tolerance_mm = 250").unwrap_err().what.contains("looks like micrometres"));
        let head = |p: &str| Settings::parse(&format!("[head]\npoints_mm = [[0, 0, 90], {p}]"));
        assert!(head("[-40, 0, 120.5]").is_ok());
        for p in ["[3000, 0, 0]", "[nan, 0, 0]"] {
            assert!(head(p).unwrap_err().what.contains("head.points_mm"), "{p}");
        }
        let comma = Settings::parse("[working_volume]\nnear_mm = 60,5\nfar_mm = 320").unwrap_err();
        assert!(comma.cause.contains("decimal comma") && comma.what.contains("line 2"), "{comma}");
        let s = Settings { name: "x".into(), robot: Some(Convention::Denso), ..Settings::default() };
        assert_eq!(Settings::parse(&toml::to_string(&s).unwrap()).unwrap(), s);
        // The keys that are written as comments can be used by removing the "# ".
        let dir = tempfile::tempdir().unwrap();
        s.store(dir.path()).unwrap();
        assert_eq!(Settings::load(dir.path()).unwrap(), s);
        let text = std::fs::read_to_string(dir.path().join("station.toml")).unwrap();
        let used = ["tolerance_mm", "[working_volume]", "near_mm", "far_mm"]
            .iter()
            .fold(text, |text, key| text.replace(&format!("# {key}"), key));
        let used = Settings::parse(&used).unwrap();
        assert_eq!((used.tolerance_mm, used.volume().map(|v| v.far_mm)), (Some(0.2), Some(300.0)));
    }
}
