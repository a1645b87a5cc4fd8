//! In: a rig, what shall be different from its defaults, pictures. Out: their points.
//! Frame and unit: robot's base, mm; a single picture's points are in the camera's frame.

use super::given::{Given, GivenSource, format_of};
use super::profiles::Profiles;
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::Recording;
use crate::rig::{Rig, Volume};
use crate::scan::{Ambient, Engine, Extraction, Measured, Optical, Place, RecordingSource, Where, parts_for};
use crate::station::scan::done::scanner_for;
use crate::station::scan::held::{HeldScan, scan_held};
use crate::station::scan::options::ScanOptions;
use crate::station::scan::recorded::scan_recording;
use crate::station::scan::report::ScanReport;
use crate::station::settings::Settings;
use std::path::Path;
use std::sync::Arc;

type Told = Arc<dyn Fn(usize, Option<usize>) + Send + Sync>;

/// A scan with a rig: say what is different, then give pictures.
///
/// ```no_run
/// use sheetlight::{Scan, recording::Recording, scan::Where};
/// # fn main() -> sheetlight::fault::Result<()> {
/// let scan = Scan::at("cell3")?.on(Where::Cpu).cell_mm(0.2);
/// let held = scan.recording(&Recording::open("recordings/board7".as_ref())?)?;
/// println!("{} points", held.points.len());
/// # Ok(()) }
/// ```
#[derive(Clone)]
pub struct Scan {
    rig: Rig,
    options: ScanOptions,
    told: Option<Told>,
}

impl Scan {
    /// A scan with the calibrations and settings of a station's folder.
    ///
    /// # Errors
    /// One of them cannot be read, or they do not belong together.
    pub fn at(station: impl AsRef<Path>) -> Result<Scan> {
        let (settings, rig) = (Settings::load(station.as_ref())?, Rig::load(station.as_ref())?);
        let options = ScanOptions::for_station(&settings, &rig, Path::new(""));
        let latency = crate::capture::Latency::load(station.as_ref())?;
        Ok(Scan { options: ScanOptions { latency, ..options }, rig, told: None })
    }

    /// A scan with these calibrations and the default settings.
    pub fn of(rig: Rig) -> Scan {
        Scan { options: ScanOptions::for_station(&Settings::default(), &rig, Path::new("")), rig, told: None }
    }

    /// Where the stages run; by default on a hardware GPU, else on the processor.
    pub fn on(mut self, place: Where) -> Scan {
        self.options.place = place;
        self
    }
    /// Camera depths at which points are accepted; by default the station's, else those of the laser plane's boards.
    pub fn volume(mut self, volume: Volume) -> Scan {
        self.options.volume = Some(volume);
        self
    }
    /// Cell of the height map, mm; by default about 1.5 points a cell.
    pub fn cell_mm(mut self, cell: f64) -> Scan {
        self.options.grid.cell = Some(cell);
        self
    }
    /// How the stripe is found; by default as the station says.
    pub fn extraction(mut self, extraction: Extraction) -> Scan {
        self.options.extraction = extraction;
        self
    }
    /// A picture with the laser off and the shots' exposure, which is subtracted from every shot.
    pub fn ambient(mut self, picture: Image) -> Scan {
        self.options.ambient = Some(picture);
        self
    }
    /// Leaves out the shots of a recording that cannot be read; by default they end the scan.
    pub fn skip_bad(mut self) -> Scan {
        self.options.skip_bad = true;
        self
    }
    /// Calls `told` after each shot with the number of shots done and the number of all shots, if it is known.
    pub fn progress(mut self, told: impl Fn(usize, Option<usize>) + Send + Sync + 'static) -> Scan {
        self.told = Some(Arc::new(told));
        self
    }

    fn tell(&self) -> impl Fn(usize, Option<usize>) {
        |done, all| self.told.iter().for_each(|told| told(done, all))
    }

    /// Scans a recording into memory.
    ///
    /// # Errors
    /// A calibration is missing, or a shot cannot be read.
    pub fn recording(&self, recording: &Recording) -> Result<HeldScan> {
        let options = ScanOptions { motion: recording.meta.motion(), ..self.options.clone() };
        let mut source = RecordingSource::late(recording, None, 0, options.latency.as_ref())?;
        scan_held(&recording.folder.display().to_string(), &mut source, &self.rig, &options, self.tell())
    }

    /// Scans a recording into a folder: cloud.ply, height map, pictures, scan.json, page.
    ///
    /// # Errors
    /// Those of [`Scan::recording`], and a folder that cannot be written.
    pub fn recording_into(&self, recording: &Recording, out: impl AsRef<Path>) -> Result<ScanReport> {
        let options = ScanOptions { out: out.as_ref().to_owned(), ..self.options.clone() };
        scan_recording(recording, None, &self.rig, &options, self.tell())
    }

    /// Scans pictures that a program has, each with the pose of the robot's flange.
    ///
    /// # Errors
    /// A calibration is missing; there is no picture; one has another size or depth than the first; the iterator's own.
    pub fn pictures(&self, pictures: impl IntoIterator<Item = Given>) -> Result<HeldScan> {
        let mut source = GivenSource::new(pictures.into_iter())?;
        scan_held("pictures", &mut source, &self.rig, &self.options, self.tell())
    }

    /// The profiles of such pictures, each as soon as it is measured; memory does not grow with their number.
    ///
    /// # Errors
    /// Those of [`Scan::pictures`]; those of later pictures come from the iterator.
    pub fn profiles<'a, I>(&self, pictures: I) -> Result<Profiles<'a>>
    where
        I: IntoIterator<Item = Given>,
        I::IntoIter: 'a,
    {
        let source = Box::new(GivenSource::new(pictures.into_iter())?);
        let rig = parts_for(&self.rig, &self.options.motion);
        rig.belong_together()?;
        let (scanner, _) = scanner_for(&rig, &*source, &self.options, self.options.place.open()?)?;
        Ok(Profiles::new(source, scanner))
    }

    /// The stripe of one picture: its peaks, and their points in the camera's frame, mm. No robot is needed.
    ///
    /// # Errors
    /// Camera or laser plane are missing, or no stripe is seen.
    pub fn picture(&self, picture: Image) -> Result<Measured> {
        self.rig.belong_together()?;
        let (o, size) = (&self.options, [picture.width, picture.height]);
        let optical = Optical {
            camera: self.rig.need_camera()?.for_pictures(size, None)?,
            laser: self.rig.need_laser_plane()?.value,
            depth_mm: Volume::depths(o.volume.as_ref()),
        };
        let format = format_of(&picture);
        let ambient = o.ambient.clone().map(|image| Ambient::new(image, format)).transpose()?;
        let mut engine = Engine::new(format, &optical, &o.extraction, ambient, o.place.open()?);
        let seen = engine.measure(&[&picture]).ok_or_else(|| {
            Fault::input("no stripe is seen")
                .cause("the laser was off, or exposure and laser do not suit the surface")
                .next("look at the picture")
        })?;
        engine.set_stripe(&seen.stripe)?;
        engine.submit(0, picture, Place::camera())?;
        Ok(engine.collect(true)?.remove(0))
    }
}
