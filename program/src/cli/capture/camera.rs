//! In: a camera. Out: the list of cameras, a camera's features, one picture with its findings, the exposure that
//! suits the stripe.
//! Frame and unit: features by the standard names (SFNC); px, us.

use crate::cli::terminal::arguments::parse;
use crate::cli::terminal::console::Console;
use sheetlight::capture::{
    CameraUri, PictureSource, Proposal, RawFormat, Tuned, Value, fresh, look, propose, tune, unexposed,
};
use sheetlight::fault::{Fault, Kind, Result};
use sheetlight::raster::Image;
use sheetlight::rig::Rig;
use sheetlight::scan::{Live, Where, overlay};
use sheetlight::station::Settings;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[derive(clap::Subcommand)]
pub enum Command {
    /// List the cameras that answer
    List,
    /// Show a camera's features with values, units and ranges
    #[command(after_help = "Example:
  sheetlight camera show --camera gige://first
Guide: docs/live.md")]
    Show(Named),
    /// Set a feature of a camera
    #[command(after_help = "Examples:
  sheetlight camera set ExposureTime 800 --camera gige://first
  sheetlight camera set PixelFormat Mono12 --camera gige://first
Guide: docs/live.md")]
    Set {
        /// Feature name: ExposureTime (us), Gain, Width, PixelFormat, AcquisitionFrameRate, TriggerMode, ...
        key: String,
        /// New value
        value: String,
        #[command(flatten)]
        named: Named,
    },
    /// Take one picture and report its levels
    #[command(after_help = "Example:
  sheetlight camera snap now.png --camera gige://first --station cell3
Guide: docs/live.md")]
    Snap {
        /// PNG file
        out: PathBuf,
        #[command(flatten)]
        named: Named,
        /// Station folder: also draw the found stripe into OUT_stripe.png
        #[arg(long)]
        station: Option<PathBuf>,
    },
    /// Set the exposure automatically: peaks of the stripe at 70 to 85 % of full scale
    ///
    /// Where one exposure cannot hold the scene it also proposes several (sheetlight record --exposures), from
    /// pictures that it takes with shorter and longer exposures.
    #[command(after_help = "Example:
  sheetlight camera tune --camera gige://first
Guide: docs/live.md")]
    Tune(Named),
}

/// The camera that is meant.
#[derive(clap::Args)]
pub struct Named {
    /// Camera: gige://first, ffmpeg:/dev/video0, cell://HOST:PORT, sim:SEED, ... (docs/live.md)
    #[arg(long, value_name = "URI", value_parser = parse::<CameraUri>)]
    camera: CameraUri,
    /// Raw frames on standard input, with --camera -: WIDTHxHEIGHT:gray8, gray10le, ...
    #[arg(long, value_parser = parse::<RawFormat>)]
    raw: Option<RawFormat>,
}

const PATIENCE: Duration = Duration::from_secs(10);

impl Named {
    fn open(&self, console: &Console) -> Result<Box<dyn PictureSource>> {
        self.waits(console);
        self.camera.open(self.raw)
    }

    /// For its features: whatever it sends.
    fn open_any(&self, console: &Console) -> Result<Box<dyn PictureSource>> {
        self.waits(console);
        self.camera.open_any(self.raw)
    }

    fn waits(&self, console: &Console) {
        if let CameraUri::Folder { path, wait_s, .. } = &self.camera {
            let folder = path.display();
            console
                .say(format!("waiting up to {wait_s:.0} s for a new picture in {folder}; those in it are not taken"));
        }
    }
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::List => list(console),
        Command::Show(named) => show(named, console),
        Command::Set { key, value, named } => set(key, value, named, console),
        Command::Snap { out, named, station } => snap(out, named, station.as_deref(), console),
        Command::Tune(named) => {
            // Checked before waiting for a picture.
            if let CameraUri::Folder { path, .. } = &named.camera {
                return Err(unexposed(&path.display().to_string()));
            }
            tune_and_propose(named.open(console)?.as_mut(), console)
        }
    }
}

/// The exposure that was found, and those that are proposed beside it.
#[derive(serde::Serialize)]
struct Exposed<'a> {
    #[serde(flatten)]
    tuned: &'a Tuned,
    #[serde(skip_serializing_if = "Option::is_none")]
    proposal: Option<Proposal>,
}

fn tune_and_propose(source: &mut dyn PictureSource, console: &Console) -> Result<()> {
    let found = tune(source, |us, seen| console.say(format!("{us:.0} us: {seen}")));
    let heard = |us: f64, saturated: f64| {
        console.say(format!("{us:.0} us: {:.2} % of the stripe is saturated", 100.0 * saturated));
    };
    let tuned = match found {
        Ok(tuned) => tuned,
        // What cannot be held by one exposure may be held by several.
        Err(fault) if fault.kind == Kind::Refused => {
            return Err(match propose(source, heard) {
                Ok(Some(p)) => Fault {
                    what: format!("{}; {p}", fault.what),
                    next: format!("{}; or record with {}", fault.next, p.option()),
                    ..fault
                },
                _ => fault,
            });
        }
        Err(fault) => return Err(fault),
    };
    let proposal = propose(source, heard)?;
    let remark = tuned.remark.as_ref().map_or(String::new(), |said| format!("no exposure is quite right: {said}\n"));
    let several = proposal.as_ref().map_or(String::new(), |p| format!("\n{p}"));
    let text = format!("ExposureTime is {:.0} us\n{remark}{}{several}", tuned.exposure_us, tuned.look);
    console.result(&Exposed { tuned: &tuned, proposal }, &text);
    Ok(())
}

fn list(console: &Console) -> Result<()> {
    let found = sheetlight::capture::source::gige::found()?;
    let mut text = String::new();
    for c in &found {
        let name = if c.serial.is_empty() { &c.ip } else { &c.serial };
        text += &format!(
            "gige://{name}  {} {} at {} (heard on {}) {}\n",
            c.manufacturer, c.model, c.ip, c.interface, c.name
        );
    }
    let videos: Vec<String> = (0..16).map(|k| format!("/dev/video{k}")).filter(|p| Path::new(p).exists()).collect();
    videos.iter().for_each(|v| text += &format!("ffmpeg:-f v4l2 -i {v}  a video device\n"));
    if text.is_empty() {
        text = format!(
            "no camera answered: asked were {} by GigE Vision's broadcast (UDP 3956), and /dev/video*; \
             a firewall that drops UDP hides cameras\n",
            sheetlight::capture::source::gige::interfaces()
        );
    }
    console.result(&serde_json::json!({ "gige": found, "video": videos }), &text);
    Ok(())
}

fn show(named: &Named, console: &Console) -> Result<()> {
    let mut source = named.open_any(console)?;
    let features = source.features()?;
    let mut text = format!("{}: {}\n", source.name(), source.format());
    for f in &features {
        let value = f.value.as_ref().map_or(String::new(), Value::to_string);
        let fixed = if f.writable { "" } else { "  (fixed now)" };
        text += &format!("{:32} {value} {}  [{}]{fixed}\n", f.name, f.unit, f.range);
    }
    console.result(&features, &text);
    Ok(())
}

fn set(key: &str, value: &str, named: &Named, console: &Console) -> Result<()> {
    let mut source = named.open_any(console)?;
    source.set(key, value)?;
    let now = source.features()?.into_iter().find(|f| f.name == key);
    // Cameras from before the standard's second version use another name.
    let shown = now.as_ref().and_then(|f| f.value.as_ref()).map_or("set".into(), |v| format!("is {v}"));
    console.result(&now, &format!("{key} {shown}"));
    Ok(())
}

fn snap(out: &Path, named: &Named, station: Option<&Path>, console: &Console) -> Result<()> {
    let mut source = named.open(console)?;
    let image = fresh(source.as_mut(), PATIENCE)?;
    drop(source);
    let seen = look(&image);
    sheetlight::files::write(out, &sheetlight::raster::png(&image))?;
    let mut text = format!("{}\n{seen}", out.display());
    if let Some(station) = station {
        text += &stripe(out, image, station)?;
    }
    console.result(&seen, &text);
    Ok(())
}

/// Draws the stripe as the station's extraction finds it.
fn stripe(out: &Path, image: Image, station: &Path) -> Result<String> {
    let (settings, rig) = (Settings::load(station)?, Rig::load(station)?);
    let format = sheetlight::capture::Format::of(&image);
    let volume = sheetlight::station::volume::believed(&settings, &rig);
    let mut live = Live::new(&rig, format, &settings.extraction, volume.as_ref(), Where::default())?;
    let Some(found) = live.measure(0, image.clone())? else { return Ok("\nno stripe is found".into()) };
    let stem = out.file_stem().ok_or_else(|| Fault::usage("the picture has no name").next("give a PNG file"))?;
    let beside = out.with_file_name(format!("{}_stripe.png", stem.to_string_lossy()));
    overlay::draw(&image, &found.peaks).save_png(&beside)?;
    let there = found.points.iter().filter(|p| p.sigma_mm.is_finite());
    let depths: Vec<f32> = there.map(|p| p.position[2]).collect();
    let (near, far) = depths.iter().fold((f32::MAX, f32::MIN), |(n, f), z| (n.min(*z), f.max(*z)));
    Ok(match depths.len() {
        0 => format!("\n0 points, {}", beside.display()),
        n => format!("\n{n} points at depths of {near:.1} to {far:.1} mm, {}", beside.display()),
    })
}
