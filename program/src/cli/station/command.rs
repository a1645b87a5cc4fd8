//! In: a station folder. Out: a new station, a summary, or values imported or exported.
//! Frame and unit: camera and flange frames, mm.

use super::{keep, serve};
use crate::cli::calibrate::store::stale;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::camera::{LENS, NAMES};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Axis, AxisKind, Frame, Rigid};
use sheetlight::rig::{Calibration, Kind, Rig};
use sheetlight::robot::Convention;
use sheetlight::station::{Settings, Sigmas, Values, ValuesFormat, remarks_of_import, written_camera};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub enum Command {
    /// Make a station folder with its station.toml
    New(New),
    /// Show a station's calibrations and their uncertainty
    Show(Show),
    /// Store known calibration values, or another program's camera, from a file (docs/file-formats.md)
    Import(Import),
    /// Write a station's values as a file that import reads, or its camera for another program
    Export(Export),
    Set(keep::Set),
    Backup(keep::BackUp),
    Restore(keep::Restore),
    Serve(Box<serve::Serve>),
    Password(serve::Password),
    /// Vouch for a refused calibration file (old, edited, of another camera)
    ///
    /// The file gets a new seal and your reason, and every report made with it shows the reason. A file that does not
    /// hold a valid calibration (a direction that is not 1 long, an invalid covariance) is refused even so.
    #[command(after_help = "Example:
  sheetlight station seal --station cell3 --kind laser-plane --because gauge-block-of-may
Guide: docs/file-formats.md")]
    Seal(Seal),
}

#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight station new --station cell3 --robot denso --mount eye-in-hand
Guide: docs/file-formats.md")]
pub struct New {
    /// New station folder
    #[arg(long)]
    station: PathBuf,
    /// Name on pages and in files [default: the folder's]
    #[arg(long)]
    name: Option<String>,
    /// Notation of the robot's poses: denso, ur, kuka, fanuc, abb, ... (docs/conventions.md) [default: matrices]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Convention>)]
    robot: Option<Convention>,
    /// Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: not stated]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Mount>)]
    mount: Option<Mount>,
}

#[derive(clap::Args)]
pub struct Show {
    /// Station folder
    #[arg(long)]
    station: PathBuf,
}

#[derive(clap::Args)]
pub struct Import {
    /// JSON file with the values, or another program's file of a camera (docs/file-formats.md)
    values: PathBuf,
    /// Station folder; created if missing
    #[arg(long)]
    station: PathBuf,
    /// Accept values that look like another unit
    #[arg(long)]
    as_stated: bool,
    /// Scatter of the robot's positions per axis, mm, 1 sigma as all of these [default: 0.02, assumed]
    #[arg(long, value_name = "MM")]
    robot_sigma_mm: Option<f64>,
    /// Scatter of the robot's orientations per axis, degrees [default: 0.004, assumed]
    #[arg(long, value_name = "DEG")]
    robot_sigma_deg: Option<f64>,
    /// Error of the camera's position per axis, mm [default: 0.03, assumed]
    #[arg(long, value_name = "MM")]
    hand_eye_sigma_mm: Option<f64>,
    /// Error of the camera's orientation per axis, degrees [default: 0.006, assumed]
    #[arg(long, value_name = "DEG")]
    hand_eye_sigma_deg: Option<f64>,
    /// Error of the laser plane at the working distance, mm [default: 0.02, assumed]
    #[arg(long, value_name = "MM")]
    plane_sigma_mm: Option<f64>,
    /// Error of the laser plane's tilt, degrees [default: 0.006, assumed]
    #[arg(long, value_name = "DEG")]
    plane_sigma_deg: Option<f64>,
    /// Error of focal lengths and principal point, px [default: 0.5, assumed]
    #[arg(long, value_name = "PX")]
    camera_sigma_px: Option<f64>,
}

/// The result of an import.
#[derive(serde::Serialize)]
struct Stored {
    stored: Vec<Kind>,
    /// How the file was read, and what was assumed.
    remarks: Vec<String>,
}

impl Import {
    fn sigmas(&self) -> Sigmas {
        Sigmas {
            robot_mm: self.robot_sigma_mm,
            robot_deg: self.robot_sigma_deg,
            hand_eye_mm: self.hand_eye_sigma_mm,
            hand_eye_deg: self.hand_eye_sigma_deg,
            plane_mm: self.plane_sigma_mm,
            plane_deg: self.plane_sigma_deg,
            camera_px: self.camera_sigma_px,
        }
    }
}

#[derive(clap::Args)]
pub struct Seal {
    /// Station folder
    #[arg(long)]
    station: PathBuf,
    /// camera, laser-plane, pointer, hand-eye, base-camera, linear-axis or turntable
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Kind>)]
    kind: Kind,
    /// Reason to trust the file; stored in it and shown in every report
    #[arg(long)]
    because: String,
    /// Accept values that look like another unit
    #[arg(long)]
    as_stated: bool,
}

#[derive(clap::Args)]
pub struct Export {
    /// Station folder
    #[arg(long)]
    station: PathBuf,
    /// File for the values (JSON), or for the camera alone (YAML, XML, JSON)
    #[arg(long)]
    out: PathBuf,
    /// Format: values (all of the station, for import), or the camera for opencv, ros (camera_info) or kalibr; for
    /// opencv the extension of --out is .yaml, .xml or .json
    #[arg(long = "as", default_value = "values", value_parser = crate::cli::terminal::arguments::parse::<ValuesFormat>)]
    format: ValuesFormat,
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Set(a) => return keep::set(a, console),
        Command::Backup(a) => return keep::back_up(a, console),
        Command::Restore(a) => return keep::restore(a, console),
        Command::Serve(a) => return serve::run(a, console),
        Command::Password(a) => return serve::password(a, console),
        Command::New(a) => return make(a, console),
        Command::Show(a) => {
            let (settings, rig) = (Settings::load(&a.station)?, Rig::load(&a.station)?);
            console.result(&Values::of(&rig), &summary(&settings, &rig));
        }
        Command::Import(a) => {
            let stored = Values::load(&a.values)?.store(&a.station, &a.values, a.as_stated, &a.sigmas())?;
            if !a.station.join("station.toml").exists() {
                Settings { name: named(&a.station), ..Settings::default() }.store(&a.station)?;
            }
            let rig = Rig::load(&a.station);
            let remarks = rig.as_ref().map_or_else(|_| Vec::new(), |rig| remarks_of_import(rig, &stored));
            let names: Vec<String> = stored.iter().map(|k| k.words()).collect();
            let text = format!("{}: imported {}", a.station.display(), names.join(", "));
            let result = Stored { stored, remarks };
            console.result(&result, &text);
            // Another record of the station may be spoilt; the values are stored even so.
            rig?;
            result.remarks.iter().for_each(|remark| console.say(remark));
            stale(&a.station, console);
        }
        Command::Export(a) => {
            outputs::check(&[&a.out], &Inputs { station: Some(&a.station), ..Inputs::default() })?;
            let rig = Rig::load(&a.station)?;
            let extension = a.out.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
            let text = match a.format {
                ValuesFormat::Values => serde_json::to_string_pretty(&Values::of(&rig)).expect("plain numbers"),
                other => written_camera(&rig.need_camera()?.value, other, &extension)?,
            };
            sheetlight::files::write(&a.out, text.as_bytes())?;
            console.say(format!("{}: written", a.out.display()));
        }
        Command::Seal(a) => return seal(a, console),
    }
    Ok(())
}

fn make(a: &New, console: &Console) -> Result<()> {
    if a.station.join("station.toml").exists() {
        let what = format!("{}: is a station already", a.station.display());
        return Err(Fault::usage(what).next("choose another folder"));
    }
    let name = a.name.clone().unwrap_or_else(|| named(&a.station));
    let settings = Settings { name, robot: a.robot, mount: a.mount, ..Settings::default() };
    settings.store(&a.station)?;
    console.result(&settings, &format!("{}: made; calibrate it or import values next", a.station.display()));
    Ok(())
}

/// Seals a calibration that was edited.
fn seal(a: &Seal, console: &Console) -> Result<()> {
    if a.because.trim().is_empty() {
        return Err(Fault::usage("--because says nothing").next("give the reason to trust the file"));
    }
    let path = Rig::vouch(&a.station, a.kind, a.because.trim(), a.as_stated)?;
    console.result(&path, &format!("{}: sealed; reports made with it say so", path.display()));
    stale(&a.station, console);
    Ok(())
}

/// The default name of a station.
fn named(folder: &Path) -> String {
    let full = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    full.file_name().map_or_else(|| "station".into(), |n| n.to_string_lossy().into_owned())
}

fn summary(settings: &Settings, rig: &Rig) -> String {
    let camera = line("camera", &rig.camera, |c| {
        let terms = c.distortion.to_opencv();
        let lens: Vec<String> = NAMES[LENS..].iter().zip(terms).map(|(name, t)| format!("{name} {t:.6}")).collect();
        format!(
            "fx {:.3} fy {:.3} cx {:.3} cy {:.3} px, {}, {}x{}",
            c.fx,
            c.fy,
            c.cx,
            c.cy,
            lens.join(" "),
            c.width,
            c.height
        )
    });
    let plane = line("laser plane", &rig.laser_plane, |p| {
        format!("normal {:.6} {:.6} {:.6}, offset {:.4} mm", p.normal.x, p.normal.y, p.normal.z, p.offset)
    });
    let pointer = line("pointer", &rig.pointer, |r| {
        let (o, d) = (r.origin, r.direction);
        format!("through {:.3} {:.3} {:.3} mm along {:.6} {:.6} {:.6}", o.x, o.y, o.z, d.x, d.y, d.z)
    });
    let hand_eye = line("hand-eye", &rig.hand_eye, pose);
    let axis = |kind: AxisKind, part| {
        let shown = |a: &Axis| {
            let (d, p) = (a.direction(), a.origin());
            let through = format!(", through {:.3} {:.3} {:.3} mm", p.x, p.y, p.z);
            format!(
                "{:.8} {} a {} along {:.6} {:.6} {:.6}{} (camera frame)",
                a.pitch,
                if kind == AxisKind::Linear { "mm" } else { "rad" },
                a.unit.name(),
                d.x,
                d.y,
                d.z,
                if kind == AxisKind::Linear { "" } else { &through }
            )
        };
        if_there(kind.words(), part, shown)
    };
    let linear = axis(AxisKind::Linear, &rig.linear_axis);
    let turntable = axis(AxisKind::Turntable, &rig.turntable);
    let base_camera = if_there("base camera", &rig.base_camera, pose);
    let profile_hand_eye = if_there("profile hand-eye", &rig.profile_hand_eye, pose);
    let stale = rig.stale();
    let stale =
        stale.iter().map(|(kind, _)| format!("not used: the {} was measured with another camera\n", kind.words()));
    let stale: String = stale.collect();
    format!(
        "{}\n{camera}{plane}{pointer}{hand_eye}{base_camera}{linear}{turntable}{profile_hand_eye}{stale}",
        settings.name
    )
}

fn pose<To: Frame, From: Frame>(pose: &Rigid<To, From>) -> String {
    let n = Convention::Denso.write(pose);
    format!(
        "{:.4} {:.4} {:.4} mm, RX {:.4} RY {:.4} RZ {:.4} degrees (R = Rz·Ry·Rx)",
        n[0], n[1], n[2], n[3], n[4], n[5]
    )
}

/// Most stations have a robot that carries the camera. Of what others have, nothing is said where it is missing.
fn if_there<T>(what: &str, calibration: &Option<Calibration<T>>, value: impl Fn(&T) -> String) -> String {
    if calibration.is_some() { line(what, calibration, value) } else { String::new() }
}

fn line<T>(what: &str, calibration: &Option<Calibration<T>>, value: impl Fn(&T) -> String) -> String {
    let Some(c) = calibration else { return format!("{what:12} not calibrated\n") };
    let mut s = format!(
        "{what:12} {}\n{:12} {} ({}, {})\n",
        value(&c.value),
        "",
        c.quality.verdict.words(),
        c.program,
        c.created
    );
    for r in c.quality.reasons.iter().chain(&c.remarks) {
        s += &format!("{:12} {r}\n", "");
    }
    s
}
