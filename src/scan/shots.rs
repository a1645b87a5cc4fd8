//! In: the camera pose at each shot of a scan. Out: `shots.jsonl`, which grows with the scan. Later steps read from
//! it the camera pose at a shot and the image axis that the stripe runs along.
//! Frame and unit: the cloud's frame, mm (docs/file-formats.md).

use super::CloudPoint;
use crate::fault::{Fault, Result};
use crate::files::moment;
use crate::geometry::{Base, Camera, Plane, Ray, Rigid, Vec3};
use glam::Vec2;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The file's name in a scan folder.
pub const SHOTS_FILE: &str = "shots.jsonl";
const FORMAT: &str = "sheetlight shots 1";
const UNITS: &str = "mm";

/// The image axis that is closer to the stripe's direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Along {
    /// From column to column: a lying stripe.
    U,
    /// From row to row: an upright stripe.
    V,
}

impl Along {
    /// The axis of a stripe whose normal in the image is this direction.
    pub fn crossed(Vec2 { x, y }: Vec2) -> Along {
        if y.abs() >= x.abs() { Along::U } else { Along::V }
    }

    /// Step to the next pixel along the stripe: columns and rows, px.
    pub fn step(self) -> [u32; 2] {
        match self {
            Along::U => [1, 0],
            Along::V => [0, 1],
        }
    }
}

/// Data about the shots of a cloud that its points do not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Shots {
    /// How the stripe lies in the pictures.
    pub along: Along,
    /// Width of the stripe across it, px (1 sigma); `None` if it was not measured.
    pub stripe_px: Option<f32>,
    /// The laser's sheet, camera frame; `None` if it was not recorded.
    pub sheet: Option<Plane<Camera>>,
    places: BTreeMap<u32, Rigid<Base, Camera>>,
}

impl Shots {
    /// Shots with their camera poses, cloud's frame.
    pub fn new(along: Along, places: impl IntoIterator<Item = (u32, Rigid<Base, Camera>)>) -> Shots {
        Shots { places: places.into_iter().collect(), ..Shots::unplaced(along) }
    }

    /// Shots with unknown poses, as of an imported map.
    pub fn unplaced(along: Along) -> Shots {
        Shots { along, stripe_px: None, sheet: None, places: BTreeMap::new() }
    }

    /// The same shots with this stripe width, px (1 sigma).
    pub fn with_stripe(self, stripe_px: Option<f32>) -> Shots {
        Shots { stripe_px, ..self }
    }

    /// The same shots with other camera poses.
    pub fn moved(&self, motion: impl Fn(u32, Rigid<Base, Camera>) -> Rigid<Base, Camera>) -> Shots {
        let places = self.places().map(|(shot, place)| (shot, motion(shot, place))).collect();
        Shots { places, ..self.clone() }
    }

    /// Moves points from where [`super::Thick`] put them to where the rays of their light's middle meet the sheet.
    /// Edges of parts are where the sheet's middle crosses them. Without a sheet the points stay.
    pub fn onto_sheet(&self, points: &mut [CloudPoint]) {
        let Some(sheet) = &self.sheet else { return };
        for p in points {
            let Some(place) = self.place(p.shot) else { continue };
            let seen = place.inverse().point(&p.at());
            let met = Ray::new(Vec3::zeros(), seen).and_then(|ray| ray.meet(sheet));
            if let Some(on) = met {
                *p = p.moved_to(place.point(&on));
            }
        }
    }

    /// Camera pose at a shot, cloud's frame; `None` for a shot that is not listed.
    pub fn place(&self, shot: u32) -> Option<&Rigid<Base, Camera>> {
        self.places.get(&shot)
    }

    /// All shots with their camera poses, in their order.
    pub fn places(&self) -> impl Iterator<Item = (u32, Rigid<Base, Camera>)> + '_ {
        self.places.iter().map(|(shot, place)| (*shot, *place))
    }

    /// The text of a scan folder's file with every pose changed by `motion(shot, pose)`; everything else is
    /// unchanged.
    pub fn rewritten(scan: &Path, motion: impl Fn(u32, Rigid<Base, Camera>) -> Rigid<Base, Camera>) -> Result<String> {
        let path = scan.join(SHOTS_FILE);
        let text = crate::files::read_text(&path)?;
        let mut lines = text.lines();
        let head = lines.next().unwrap_or_default().to_owned() + "\n";
        let one = |text: &str| {
            let Line { shot, from_camera } = serde_json::from_str(text).map_err(|e| {
                Fault::input(format!("{}: {e}", path.display()))
                    .cause("damaged while it was written")
                    .next("scan again")
            })?;
            Ok(line(&Line { shot, from_camera: motion(shot, from_camera) }))
        };
        lines.map(one).try_fold(head, |text, line: Result<String>| Ok(text + &line?))
    }

    /// Reads a scan folder's file, for a cloud in `frame` that was made with `rig` (its fingerprint).
    ///
    /// # Errors
    /// No file, malformed lines, a shot listed twice, another frame, unit or calibration.
    pub fn load(scan: &Path, frame: &str, rig: &str) -> Result<Shots> {
        let path = scan.join(SHOTS_FILE);
        let again = "scan again";
        let Some(text) = crate::files::read_text_if_there(&path)? else {
            return Err(missing(scan));
        };
        let strange = |n: usize, what: String| {
            Fault::input(format!("{} line {}: {what}", path.display(), n + 1))
                .cause("another version, edited by hand, or damaged")
                .next(again)
        };
        let mut lines = text.lines();
        let head: Head = serde_json::from_str(lines.next().unwrap_or_default())
            .map_err(|e| strange(0, format!("is not the head of a list of shots: {e}")))?;
        if head.format != FORMAT {
            return Err(strange(0, format!("is of format {:?}, this version reads {FORMAT}", head.format)));
        }
        if (head.frame.as_str(), head.units.as_str()) != (frame, UNITS) {
            let is =
                format!("is in the {} frame and {}, the scan in the {frame} frame and {UNITS}", head.frame, head.units);
            return Err(strange(0, is));
        }
        if head.rig != rig {
            return Err(strange(0, format!("is of calibration {:.12}, the scan of {rig:.12}", head.rig)));
        }
        let mut shots = Shots { sheet: head.sheet, ..Shots::unplaced(head.stripe_along) };
        for (n, line) in lines.enumerate().map(|(i, line)| (i + 1, line)) {
            let Line { shot, from_camera } = serde_json::from_str(line).map_err(|e| strange(n, e.to_string()))?;
            if shots.places.insert(shot, from_camera).is_some() {
                return Err(strange(n, format!("shot {shot} stands there twice")));
            }
        }
        Ok(shots)
    }
}

fn missing(folder: &Path) -> Fault {
    Fault::input(format!("{}: is not there", folder.join(SHOTS_FILE).display()))
        .cause("scanned by an earlier version, which did not store the camera's poses")
        .next("scan again, without --resume: the pictures are still there")
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    format: String,
    /// The cloud's frame.
    frame: String,
    units: String,
    stripe_along: Along,
    /// Fingerprint of the rig that the points were made with.
    rig: String,
    /// The rig's laser plane, camera frame; older versions did not write it, and profiles of a sensor have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sheet: Option<Plane<Camera>>,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    shot: u32,
    from_camera: Rigid<Base, Camera>,
}

fn line<T: serde::Serialize>(value: &T) -> String {
    serde_json::to_string(value).expect("plain data") + "\n"
}

/// Adds shots to the file as they are done.
pub struct ShotsWriter {
    path: PathBuf,
    out: File,
    /// Lines not yet written.
    next: String,
}

impl ShotsWriter {
    /// Starts a list; an existing one of that name is discarded. `frame` is the cloud's, `rig` the rig's
    /// fingerprint, `sheet` its laser plane; profiles of a sensor have none.
    pub fn create(
        folder: &Path,
        frame: &str,
        along: Along,
        rig: &str,
        sheet: Option<&Plane<Camera>>,
    ) -> Result<ShotsWriter> {
        let head = Head {
            format: FORMAT.into(),
            frame: frame.into(),
            units: UNITS.into(),
            stripe_along: along,
            rig: rig.into(),
            sheet: sheet.copied(),
        };
        ShotsWriter::with(folder, &line(&head))
    }

    /// Continues the list of an interrupted scan that completed the shots before `done`; later lines are cut off.
    ///
    /// # Errors
    /// As [`Shots::load`].
    pub fn resume(folder: &Path, done: usize, frame: &str, rig: &str) -> Result<ShotsWriter> {
        // The scan was stopped while the reported poses were set aside for the corrected ones.
        let (path, measured) = (folder.join(SHOTS_FILE), folder.join(format!("{SHOTS_FILE}.part")));
        if measured.exists() {
            moment().and_then(|()| std::fs::rename(&measured, &path)).map_err(|e| Fault::write(&path, e))?;
        }
        let text = match crate::files::read_text_if_there(&path)? {
            Some(text) => text,
            None => return Err(missing(folder)),
        };
        // The last line may be incomplete.
        let whole = text.split_inclusive('\n').filter(|l| l.ends_with('\n'));
        let is_done = |l: &&str| serde_json::from_str::<Line>(l).map_or(true, |l| (l.shot as usize) < done);
        let kept: String = whole.take_while(is_done).collect();
        let writer = ShotsWriter::with(folder, &kept)?;
        Shots::load(folder, frame, rig)?;
        Ok(writer)
    }

    fn with(folder: &Path, text: &str) -> Result<ShotsWriter> {
        let path = folder.join(SHOTS_FILE);
        crate::files::write(&path, text.as_bytes())?;
        let out = File::options().append(true).open(&path).map_err(|e| Fault::write(&path, e))?;
        Ok(ShotsWriter { path, out, next: String::new() })
    }

    /// Adds a shot; [`ShotsWriter::checkpoint`] writes it.
    pub fn add(&mut self, shot: u32, from_camera: Rigid<Base, Camera>) {
        self.next += &line(&Line { shot, from_camera });
    }

    /// Syncs everything to the disk.
    pub fn checkpoint(&mut self) -> Result<()> {
        let text = std::mem::take(&mut self.next);
        moment()
            .and_then(|()| self.out.write_all(text.as_bytes()))
            .and_then(|()| self.out.sync_data())
            .map_err(|e| Fault::write(&self.path, e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::exp;

    fn place(shot: u32) -> Rigid<Base, Camera> {
        let k = f64::from(shot);
        Rigid::new(exp(&Vec3::new(0.1 * k, 2.0, -0.3)), Vec3::new(300.0 + 0.25 * k, -40.0, 500.0))
    }

    #[test]
    fn what_is_written_is_read_and_a_cut_off_list_goes_on() {
        let dir = tempfile::tempdir().unwrap();
        let sheet = Plane::new(Vec3::new(0.0, 0.6, 0.8), 72.5).unwrap();
        let mut w = ShotsWriter::create(dir.path(), "base", Along::V, "rig", Some(&sheet)).unwrap();
        (0..5).for_each(|s| w.add(s, place(s)));
        w.checkpoint().unwrap();
        w.add(5, place(5));
        w.checkpoint().unwrap();
        let whole = Shots::load(dir.path(), "base", "rig").unwrap();
        assert_eq!((whole.along, whole.sheet, whole.places.len()), (Along::V, Some(sheet), 6));
        for s in 0..6 {
            let (turn, shift) = whole.place(s).unwrap().difference(&place(s));
            assert!(turn < 1e-12 && shift < 1e-9, "{s}");
        }
        assert!(whole.place(6).is_none());
        // An incomplete line, and shots beyond the checkpoint.
        let path = dir.path().join(SHOTS_FILE);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 30]).unwrap();
        let mut w = ShotsWriter::resume(dir.path(), 3, "base", "rig").unwrap();
        (3..6).for_each(|s| w.add(s, place(s)));
        w.checkpoint().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn other_lists_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(SHOTS_FILE);
        let sheet = Plane::new(Vec3::z(), 100.0).unwrap();
        let mut w = ShotsWriter::create(dir.path(), "base", Along::U, "rig", Some(&sheet)).unwrap();
        w.add(0, place(0));
        w.checkpoint().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let refused = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Shots::load(dir.path(), "base", "rig").unwrap_err().to_string()
        };
        let last = text.lines().last().unwrap().to_owned();
        assert!(refused(&format!("{text}{last}\n")).contains("shot 0 stands there twice"));
        assert!(refused(&text.replace("shots 1", "shots 9")).contains("shots 9"));
        assert!(refused(&text.replace("\"rig\":\"rig\"", "\"rig\":\"other\"")).contains("of calibration other"));
        assert!(refused(&text.replace("\"u\"", "\"x\"")).contains("line 1"));
        assert!(refused(&text.replace("\"base\"", "\"axis\"")).contains("in the axis frame"));
        assert!(refused(&text.replace("\"mm\"", "\"m\"")).contains("frame and m,"));
        assert!(refused("").contains("line 1"));
        std::fs::remove_file(&path).unwrap();
        assert!(Shots::load(dir.path(), "base", "rig").unwrap_err().to_string().contains("earlier version"));
    }
}
