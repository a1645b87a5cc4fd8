//! In: a short scan and one several times as long, of the same surface. Out: the long one needs no more memory, on the
//! host or on the GPU. Frame and unit: bytes. One test, for the process's high-water mark is one number.

mod common;

use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::gpu::Device;
use sheetlight::raster::Image;
use sheetlight::rig::Rig;
use sheetlight::scan::{BadShot, Extraction, Format, GridOptions, Processor, Shot, Source, Where};
use sheetlight::station::{ScanOptions, scan_on};

/// The program's own: it is judged too.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The same few pictures again and again, the robot going to and fro over 10 mm.
struct Repeating {
    pictures: Vec<Image>,
    next: usize,
    shots: usize,
}

impl Source for Repeating {
    fn format(&self) -> Format {
        let i = &self.pictures[0];
        Format { width: i.width, height: i.height, bits: i.bits }
    }
    fn remaining(&self) -> Option<usize> {
        Some(self.shots - self.next)
    }
    fn next(&mut self) -> Option<Result<Shot, BadShot>> {
        (self.next < self.shots).then(|| {
            let i = self.next;
            self.next += 1;
            let step = (i % 40).abs_diff(20) as f64;
            let base_from_flange =
                Rigid::<Base, Flange>::from_vectors(&Vec3::zeros(), Vec3::new(0.0, 0.25 * step, 0.0));
            let image = self.pictures[i % self.pictures.len()].clone();
            Ok(Shot {
                index: i as u32,
                name: format!("{i}"),
                image,
                stand: sheetlight::recording::Stand::Robot(base_from_flange),
                slip: None,
                here_ns: None,
            })
        })
    }
}

/// A stripe along the rows with a little noise.
fn picture(seed: u32) -> Image {
    let mut state = seed;
    let level = |x: u32, y: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let d = (f64::from(y) - 115.0 - 3.0 * (f64::from(x) / 40.0).sin()) / 1.2;
        (180.0 * (-0.5 * d * d).exp()) as u8 + 2 + (state >> 30) as u8
    };
    let mut level = level;
    Image::from_u8(320, 240, (0..240).flat_map(|y| (0..320).map(move |x| (x, y))).map(|(x, y)| level(x, y)).collect())
}

fn rig(folder: &std::path::Path) -> Rig {
    let values = r#"{
      "intrinsics": {"fx": 305.8, "fy": 305.8, "cx": 157, "cy": 116, "width": 320, "height": 240,
                     "distortion_k1_k2_p1_p2_k3": [-0.1, 0.05, 0, 0, 0]},
      "flange_T_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
      "laser_plane_camera": {"normal": [0, 0.883, 0.469], "offset_mm": 72}}"#;
    std::fs::write(folder.join("values.json"), values).unwrap();
    let station = folder.join("station");
    let done = std::process::Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args(["station", "import"])
        .arg(folder.join("values.json"))
        .arg("--station")
        .arg(&station)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    Rig::load(&station).unwrap()
}

/// The process's largest resident memory since the last reset, bytes.
#[cfg(target_os = "linux")]
fn high_water() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

#[test]
#[cfg(target_os = "linux")]
fn a_long_scan_needs_no_more_memory_than_a_short_one() {
    let dir = tempfile::tempdir().unwrap();
    let rig = rig(dir.path());
    let pictures: Vec<Image> = (0..8).map(picture).collect();
    let scan = |processor: &Processor, shots: usize| {
        let options = ScanOptions {
            latency: None,
            out: dir.path().join("out"),
            place: Where::Auto,
            extraction: Extraction::default(),
            // The map's size follows from the surface, not from the number of shots.
            grid: GridOptions { cell: Some(0.25), ..GridOptions::default() },
            volume: None,
            motion: sheetlight::recording::Motion::default(),
            ambient: None,
            overlays: 2,
            skip_bad: false,
            resume: false,
            stop: Default::default(),
            watch: Default::default(),
        };
        let open = |_| Ok(Box::new(Repeating { pictures: pictures.clone(), next: 0, shots }) as Box<dyn Source>);
        let report = scan_on(|| Ok(processor.clone()), "id", "test", open, &rig, &options, |_, _| {}).unwrap();
        assert!(report.points > shots as u64 * 250, "{} points of {shots} shots", report.points);
        high_water()
    };
    let mut processors = vec![("host", Processor::host(), None)];
    if let Some(device) = common::device() {
        processors.push(("GPU", Processor::Gpu(device.clone()), Some(device)));
    }
    for (name, processor, device) in processors {
        // The first scans also fill caches of the allocator and of the driver: on lavapipe, whose compiler works on
        // every thread, some ten of them, whatever their length. 700 shots fill the sample of the grid.
        let mut still = 0;
        for scans in 0.. {
            assert!(scans < 30, "{name}: {scans} scans of 700 shots, and each takes more memory than the one before");
            let before = high_water();
            still = if scan(&processor, 700) < before + 500_000 { still + 1 } else { 0 };
            if still == 4 {
                break;
            }
        }
        let gpu = |device: &Option<Device>| device.as_ref().map_or(0, Device::allocated_bytes);
        let before = gpu(&device);
        let short = scan(&processor, 700);
        let middle = gpu(&device);
        let long = scan(&processor, 2800);
        let after = gpu(&device);
        println!(
            "{name}: host {:.1} MB after 700 shots, {:.1} MB after 2,800; device {:.1} and {:.1} MB",
            short as f64 / 1e6,
            long as f64 / 1e6,
            (middle - before) as f64 / 1e6,
            (after - middle) as f64 / 1e6
        );
        // 2,100 more shots are 160 MB of pictures, 600,000 points of 36 bytes and as many peaks of 48.
        let limit = 6_000_000;
        if long > short + limit {
            // A cache of the driver may grow once more, at any time (10 MB of lavapipe's were seen). What a scan
            // keeps of its shots grows with every 2,100 of them.
            let longer = scan(&processor, 4900);
            println!("{name}: host {:.1} MB after 4,900 shots", longer as f64 / 1e6);
            let marks = format!("{short} bytes for 700 shots, {long} for 2,800, {longer} for 4,900");
            assert!(longer <= long + limit, "{name}: {marks}");
        }
        assert_eq!(after - middle, middle - before, "{name}: bytes of GPU buffers made for a scan");
    }
}
