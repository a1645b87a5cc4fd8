//! In: a recording and its station; simulated here where none are named. Out: wall and CPU time of decoding alone, of
//! the GPU's chain alone and of a whole `sheetlight scan`, in turns, and the scan over what it cannot be faster than.
//! Frame and unit: seconds. `cargo bench --bench scan -- [RECORDING STATION] [ROUNDS]`

mod common;

use common::median;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::Image;
use sheetlight::recording::Recording;
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{Engine, Optical, Place, RecordingSource, Source, Where};
use sheetlight::station::{Settings, load_report};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The program's own.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sheetlight");
/// Pictures that the stripe is measured in, as in a scan.
const MEASURED: usize = 8;

fn main() {
    let (rounds, folders): (Vec<_>, Vec<_>) =
        std::env::args().skip(1).filter(|a| !a.starts_with("--")).partition(|a| a.parse::<usize>().is_ok());
    let rounds = rounds.first().map_or(9, |n| n.parse().expect("a number"));
    let folders: Vec<PathBuf> = folders.iter().map(PathBuf::from).collect();
    let done = match &folders[..] {
        [recording, station] => measure(recording, station, rounds),
        _ => simulated().and_then(|f| measure(&f.join("scan"), &f.join("station"), rounds)),
    };
    if let Err(fault) = done {
        eprintln!("{fault}");
        std::process::exit(1);
    }
}

/// 500 shots of 640x480, made once.
fn simulated() -> Result<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("target/scan-bench");
    if !folder.join("scan/meta.json").exists() {
        sheetlight(Command::new(PROGRAM).args(["simulate", "--shots", "500", "--quiet", "--out"]).arg(&folder))?;
    }
    Ok(folder)
}

fn sheetlight(command: &mut Command) -> Result<()> {
    let done = command.stdout(Stdio::null()).status();
    match done {
        Ok(status) if status.success() => Ok(()),
        other => Err(Fault::output(format!("{command:?}: {other:?}"))),
    }
}

fn measure(folder: &Path, station: &Path, rounds: usize) -> Result<()> {
    let (recording, settings, rig) = (Recording::open(folder)?, Settings::load(station)?, Rig::load(station)?);
    let decode = || -> Result<Vec<Image>> {
        let mut source = RecordingSource::open(&recording, None, 0)?;
        std::iter::from_fn(|| source.next()).map(|s| s.map(|s| s.image).map_err(|bad| bad.fault)).collect()
    };
    let pictures = RecordingSource::open(&recording, None, 0)?.pictures();
    let format = pictures.format;
    let images = decode()?;
    let optical = Optical {
        camera: rig.need_camera()?.for_pictures(pictures.size(), pictures.readout.as_ref())?,
        laser: rig.need_laser_plane()?.value,
        depth_mm: Volume::depths(sheetlight::station::volume::believed(&settings, &rig).as_ref()),
    };
    let mut engine = Engine::new(format, &optical, &settings.extraction, None, Where::Gpu.open()?);
    let first: Vec<&Image> = images.iter().take(MEASURED).collect();
    let seen = engine.measure(&first).ok_or_else(|| Fault::input("no stripe in the first pictures"))?;
    engine.set_stripe(&seen.stripe)?;
    let place = Place::camera();
    let mut chain = |images: Vec<Image>| -> Result<usize> {
        let mut done = 0;
        for (i, image) in (0..).zip(images) {
            engine.submit(i, image, place)?;
            done += engine.collect(false)?.len();
        }
        Ok(done + engine.collect(true)?.len())
    };
    // Compiles and touches everything once.
    chain(images.clone())?;
    let out = tempfile::tempdir().map_err(|e| Fault::output(e.to_string()))?;
    let scan = || {
        sheetlight(
            Command::new(PROGRAM).arg("scan").arg(folder).arg("--station").arg(station).arg("--out").arg(out.path()),
        )
    };
    let [mut decoding, mut stages, mut scans] = [(); 3].map(|()| Vec::new());
    let mut starts = Vec::new();
    for _ in 0..rounds {
        // The pictures are dropped as they come: a scan does not keep them either.
        decoding.push(cost(|| {
            let mut source = RecordingSource::open(&recording, None, 0)?;
            let n = std::iter::from_fn(|| source.next()).filter(|s| s.is_ok()).count();
            assert_eq!(n, images.len());
            Ok(())
        })?);
        let copies = images.clone();
        stages.push(cost(|| {
            assert_eq!(chain(copies)?, images.len());
            Ok(())
        })?);
        scans.push(cost(scan)?);
        let spent = load_report(out.path())?.spent;
        starts.push(spent.start_s + spent.first_profile_s);
    }
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get()) as f64;
    println!("{} shots of {}x{}, median of {rounds} rounds", images.len(), format.width, format.height);
    for (name, costs) in [("decoding", &decoding), ("GPU chain", &stages), ("sheetlight scan", &scans)] {
        println!("{name:16} {:6.3} s wall, {:6.3} s CPU", median(costs, |c| c[0]), median(costs, |c| c[1]));
    }
    starts.sort_by(f64::total_cmp);
    println!("{:16} {:6.3} s from opening the device and the recording", "first profile", starts[starts.len() / 2]);
    // Within a round, so that all three see the same machine.
    let rounds: Vec<_> = decoding.iter().zip(&stages).zip(&scans).map(|((&d, &c), &s)| (d, c, s)).collect();
    println!("scan / larger of both: {:.2}", median(&rounds, |(d, c, s)| s[0] / d[0].max(c[0])));
    println!(
        "scan / (CPU time of both / {cores} cores): {:.2}; CPU time of the scan over that of both: {:.2}",
        median(&rounds, |(d, c, s)| s[0] / ((d[1] + c[1]) / cores)),
        median(&rounds, |(d, c, s)| s[1] / (d[1] + c[1]))
    );
    Ok(())
}

/// CPU time of this process and of those that it waited for.
fn cost(work: impl FnOnce() -> Result<()>) -> Result<[f64; 2]> {
    common::cost(cpu_seconds, work)
}

/// Hundredths of a second, as /proc/self/stat counts; NaN where there is none.
fn cpu_seconds() -> f64 {
    let Ok(text) = std::fs::read_to_string("/proc/self/stat") else { return f64::NAN };
    // The name, which may hold anything, ends with the last bracket; utime is the twelfth field behind it.
    let behind = text.rsplit_once(')').map_or("", |t| t.1);
    behind.split_whitespace().skip(11).take(4).map(|n| n.parse::<f64>().unwrap_or(f64::NAN)).sum::<f64>() / 100.0
}
