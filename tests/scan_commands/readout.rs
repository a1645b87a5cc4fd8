//! Pictures of a region of the sensor, and binned ones, give the points of the whole ones; unexplained ones are
//! refused.

use crate::common::{sheetlight, sheetlight_fails};
use sheetlight::camera::Readout;
use sheetlight::geometry::Vec3;
use sheetlight::raster::{Image, save_png};
use sheetlight::recording::{Motion, Recording};
use sheetlight::rig::Rig;
use sheetlight::scan::{
    Carrier, CloudPoint, Extraction, Format, Pictures, Processor, RecordingSource, Scanner, Source,
};
use std::path::{Path, PathBuf};

/// A simulated recording of 640x480 pictures.
struct Whole {
    dir: tempfile::TempDir,
    rig: Rig,
    images: Vec<Image>,
}

impl Whole {
    fn new() -> Whole {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("sim");
        sheetlight(&["simulate", "--out", out.to_str().unwrap(), "--width", "640", "--shots", "10", "--quiet"]);
        let recording = Recording::open(&out.join("scan")).unwrap();
        let names = recording.meta.frames.iter().filter_map(|f| f.laser.clone());
        let images = names.map(|n| recording.picture(&n).unwrap()).collect();
        Whole { rig: Rig::load(&out.join("station")).unwrap(), dir, images }
    }

    fn folder(&self, name: &str) -> PathBuf {
        self.dir.path().join("sim").join(name)
    }

    /// The points of these pictures, one a shot of the recording.
    fn points(&self, images: &[Image], readout: Option<Readout>) -> Vec<CloudPoint> {
        let carrier = Carrier::new(&self.rig, &Motion::default()).unwrap();
        let extraction = Extraction { measure_stripe: false, ..Extraction::default() };
        let pictures = Pictures { format: Format::of(&images[0]), readout };
        let mut scanner =
            Scanner::new(&self.rig, carrier, pictures, &extraction, None, None, Processor::host()).unwrap();
        let mut source = RecordingSource::open(&Recording::open(&self.folder("scan")).unwrap(), None, 0).unwrap();
        for image in images {
            let shot = source.next().unwrap().unwrap();
            scanner.push(sheetlight::scan::Shot { image: image.clone(), ..shot }).unwrap();
        }
        scanner.finish().unwrap().into_iter().flat_map(|p| p.points).collect()
    }
}

fn image(width: u32, height: u32, of: impl Fn(u32, u32) -> u32) -> Image {
    Image::from_u8(width, height, (0..width * height).map(|i| of(i % width, i / width) as u8).collect())
}

fn region(whole: &Image, [left, top]: [u32; 2], [width, height]: [u32; 2]) -> Image {
    image(width, height, |x, y| whole.get(left + x, top + y).into())
}

/// Two by two pixels are one.
fn binned(whole: &Image) -> Image {
    let sum = |x: u32, y: u32| -> u32 {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| u32::from(whole.get(x + i, y + j))).iter().sum()
    };
    image(whole.width / 2, whole.height / 2, |x, y| (sum(2 * x, 2 * y) + 2) / 4)
}

#[test]
fn a_region_gives_the_points_of_the_whole_picture() {
    let whole = Whole::new();
    let full = whole.points(&whole.images, None);
    // The first has the aspect of the whole picture, the second has not.
    for ([left, top], size) in [([150, 110], [320, 240]), ([37, 101], [560, 290])] {
        let images: Vec<Image> = whole.images.iter().map(|i| region(i, [left, top], size)).collect();
        let readout = Readout { offset_px: [left, top], ..Readout::default() };
        let part = whole.points(&images, Some(readout));
        let (mut compared, mut worst) = (0, 0f64);
        for p in &part {
            let (u, v) = (p.u + left as f32, p.v + top as f32);
            let inside = |at: f32, size: u32| at > 40.0 && at < size as f32 - 40.0;
            if !inside(p.u, size[0]) || !inside(p.v, size[1]) {
                continue;
            }
            let there = |f: &&CloudPoint| f.shot == p.shot && (f.u - u).abs() < 0.01 && (f.v - v).abs() < 0.01;
            let Some(f) = full.iter().find(there) else { continue };
            compared += 1;
            worst = worst.max((f.at() - p.at()).norm());
        }
        println!("{size:?} at {left}, {top}: {compared} of {} points compared, {worst:.6} mm", part.len());
        assert!(compared > 500 && worst < 2e-3, "{compared} of {} compared, {worst} mm", part.len());
    }
}

#[test]
fn binned_pictures_give_the_surface_of_the_whole_ones() {
    let whole = Whole::new();
    let full = whole.points(&whole.images, None);
    let images: Vec<Image> = whole.images.iter().map(binned).collect();
    let half = whole.points(&images, Some(Readout { binning: [2, 2], ..Readout::default() }));
    // How far it lies across the stripe, between the two points of the whole picture next to it; px of that picture.
    let camera = whole.rig.need_camera().unwrap().value;
    let mut off: Vec<f64> = Vec::new();
    for p in &half {
        let mut near: Vec<(f64, Vec3)> =
            full.iter().filter(|f| f.shot == p.shot).map(|f| ((f.at() - p.at()).norm(), f.at())).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [(distance, a), (_, b), ..] = near[..] else { continue };
        let along = (b - a).normalize();
        let side = (p.at() - a) - along * along.dot(&(p.at() - a));
        if distance < 1.0 {
            off.push(side.norm() / (200.0 / camera.fx));
        }
    }
    off.sort_by(f64::total_cmp);
    let median = off[off.len() / 2];
    println!("binned: {} points, {median:.4} px of the whole picture off in the median", off.len());
    assert!(off.len() > 500 && median < 0.1, "{} points, {median} px", off.len());
}

/// A region as a recording of its own.
fn record(from: &Path, to: &Path, images: &[Image], readout: Option<Readout>) {
    std::fs::create_dir(to).unwrap();
    std::fs::copy(from.join("poses.json"), to.join("poses.json")).unwrap();
    let mut meta = Recording::open(from).unwrap().meta;
    (meta.image.width, meta.image.height, meta.image.readout) = (images[0].width, images[0].height, readout);
    meta.ambient = None;
    for (frame, image) in meta.frames.iter().zip(images) {
        save_png(image, &to.join(frame.laser.as_ref().unwrap())).unwrap();
    }
    std::fs::write(to.join("meta.json"), serde_json::to_string(&meta).unwrap()).unwrap();
}

#[test]
fn a_size_that_nobody_explains_is_refused_and_a_persons_word_counts() {
    let whole = Whole::new();
    let meta = Recording::open(&whole.folder("scan")).unwrap().meta;
    assert_eq!(meta.image.readout.unwrap().sensor_px, Some([640, 480]), "what the simulator says");
    // The aspect of the calibrated size: what was taken for binning.
    let images: Vec<Image> = whole.images.iter().map(|i| region(i, [150, 110], [320, 240])).collect();
    let (silent, telling) = (whole.folder("silent"), whole.folder("telling"));
    record(&whole.folder("scan"), &silent, &images, None);
    record(&whole.folder("scan"), &telling, &images, Some(Readout { offset_px: [150, 110], ..Readout::default() }));
    let station = whole.folder("station");
    let out = |name: &str| whole.folder(name).to_str().unwrap().to_owned();
    let args = |from: &Path, to: &str| -> Vec<String> {
        let from = from.to_str().unwrap();
        ["scan", from, "--station", station.to_str().unwrap(), "--out", to, "--on", "cpu", "--quiet"]
            .map(String::from)
            .into()
    };
    let scan = |from: &Path, to: &str, word: &[&str]| {
        let args = args(from, &out(to));
        sheetlight(&args.iter().map(String::as_str).chain(word.iter().copied()).collect::<Vec<_>>());
        std::fs::read(whole.folder(to).join("cloud.ply")).unwrap()
    };
    let refused = |from: &Path, word: &[&str]| {
        let args = args(from, &out("none"));
        sheetlight_fails(&args.iter().map(String::as_str).chain(word.iter().copied()).collect::<Vec<_>>()).1
    };
    let said = refused(&silent, &[]);
    assert!(said.contains("pictures are 320x240") && said.contains("640x480") && said.contains("--region"), "{said}");
    let told = scan(&telling, "told", &[]);
    assert!(told == scan(&silent, "word", &["--region", "150,110"]), "another cloud by a person's word");
    assert!(told != scan(&silent, "wrong", &["--binned", "2"]), "the word is used");
    let said = refused(&telling, &["--region", "0,0"]);
    assert!(said.contains("omit --region and --binned"), "{said}");
    let said = refused(&silent, &["--region", "400,0"]);
    assert!(said.contains("another sensor"), "{said}");
}

/// The ways to read a sensor that keep the picture's size.
const TURNED: [(&str, fn(u32, u32) -> (u32, u32)); 4] = [
    ("turned by 180 degrees", |x, y| (639 - x, 479 - y)),
    ("mirrored left to right", |x, y| (639 - x, y)),
    ("mirrored top to bottom", |x, y| (x, 479 - y)),
    ("moved by 10 columns and -6 rows", |x, y| (x.saturating_sub(10), (y + 6).min(479))),
];

#[test]
fn pictures_that_are_turned_against_the_calibration_are_refused() {
    let whole = Whole::new();
    let scan = |name: &str, images: &[Image]| {
        let from = whole.folder(name);
        record(&whole.folder("scan"), &from, images, None);
        (from, whole.folder(&format!("{name} out")), whole.folder("station"))
    };
    for (turned, of) in TURNED {
        let read = |i: &Image| {
            image(640, 480, |x, y| {
                let (x, y) = of(x, y);
                i.get(x, y).into()
            })
        };
        let (from, out, station) = scan(turned, &whole.images.iter().map(read).collect::<Vec<_>>());
        let [from, out, station] = [&from, &out, &station].map(|p| p.to_str().unwrap());
        let said = sheetlight_fails(&["scan", from, "--station", station, "--out", out, "--on", "cpu", "--quiet"]).1;
        assert!(said.contains(&format!("the pictures are {turned}")) && said.contains("ReverseX"), "{said}");
    }
    // A pointer of another station: a scan does not use it.
    let other = whole.folder("other");
    sheetlight(&["simulate", "--out", other.to_str().unwrap(), "--seed", "2", "--shots", "2", "--quiet"]);
    let pointer = "station/calibration/pointer.json";
    std::fs::copy(other.join(pointer), whole.folder(pointer)).unwrap();
    let (from, out, station) = scan("as they are", &whole.images);
    let [from, out, station] = [&from, &out, &station].map(|p| p.to_str().unwrap());
    sheetlight(&["scan", from, "--station", station, "--out", out, "--on", "cpu", "--quiet"]);
    let report = std::fs::read_to_string(Path::new(out).join("scan.json")).unwrap();
    assert!(!report.contains("hot pixels lie"), "{report}");
}

#[test]
fn pictures_of_another_sensor_are_remarked_on() {
    let whole = Whole::new();
    let remark = |rig: &Rig| {
        let carrier = Carrier::new(rig, &Motion::default()).unwrap();
        let format = Format::of(&whole.images[0]);
        let mut scanner =
            Scanner::new(rig, carrier, format, &Extraction::default(), None, None, Processor::host()).unwrap();
        let mut source = RecordingSource::open(&Recording::open(&whole.folder("scan")).unwrap(), None, 0).unwrap();
        while let Some(shot) = source.next() {
            scanner.push(shot.unwrap()).unwrap();
        }
        scanner.finish().unwrap();
        scanner.remark()
    };
    assert_eq!(remark(&whole.rig), None);
    let mut other = whole.rig.clone();
    let hot = &mut other.camera.as_mut().unwrap().hot_pixels;
    assert!(hot.len() >= 4, "{hot:?}");
    *hot = vec![[20, 400], [333, 7], [601, 250], [111, 222], [512, 90]];
    let said = remark(&other).expect("a remark");
    assert!(said.contains("another camera") && said.contains("0 of 5 hot pixels"), "{said}");
    // A camera that was imported knows none: the laser plane's calibration may.
    other.laser_plane.as_mut().unwrap().hot_pixels = std::mem::take(&mut other.camera.as_mut().unwrap().hot_pixels);
    assert!(remark(&other).is_some());
}

#[test]
fn calibrations_know_the_hot_pixels_of_their_sensor_and_refuse_a_turned_one() {
    let dir = tempfile::tempdir().unwrap();
    let sim = dir.path().join("sim");
    let at = |name: &str| sim.join(name).to_str().unwrap().to_owned();
    sheetlight(&["simulate", "--out", sim.to_str().unwrap(), "--set", "intrinsics,laserplane", "--quiet"]);
    let known = Rig::load(&sim.join("station")).unwrap().camera.unwrap().hot_pixels;
    let station = dir.path().join("station");
    let station = station.to_str().unwrap();
    sheetlight(&["station", "new", "--station", station, "--quiet"]);
    sheetlight(&["calibrate", "camera", &at("intrinsics"), "--station", station, "--quiet"]);
    let laser_plane = ["calibrate", "laser-plane", &at("laserplane"), "--station", station, "--on", "cpu", "--quiet"];
    sheetlight(&laser_plane);
    let rig = Rig::load(Path::new(station)).unwrap();
    for found in [rig.camera.unwrap().hot_pixels, rig.laser_plane.unwrap().hot_pixels] {
        assert!(found.len() >= 4 && found.iter().all(|p| known.contains(p)), "{found:?} of {known:?}");
    }
    for entry in std::fs::read_dir(sim.join("laserplane")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "png") {
            let picture = sheetlight::raster::load(&path, sheetlight::raster::Channel::default(), 8).unwrap();
            let turned = image(640, 480, |x, y| picture.get(639 - x, 479 - y).into());
            save_png(&turned, &path).unwrap();
        }
    }
    let said = sheetlight_fails(&laser_plane).1;
    assert!(said.contains("turned by 180 degrees, compared with those of the calibration"), "{said}");
}
