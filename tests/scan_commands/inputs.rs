//! In: one simulated recording, written in every picture format and through the raw pipe. Out: the cloud is the one
//! of the PNG recording. Frame and unit: base frame, mm; grey levels.

use crate::common::{sheetlight, sheetlight_fails};
use sheetlight::raster::{Channel, Image, Pixels, load};
use sheetlight::scan::{CloudPoint, read_cloud};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SIZE: (u32, u32) = (320, 240);
const SHOTS: usize = 10;

/// A simulated recording and the cloud of its PNG pictures.
struct Original {
    dir: tempfile::TempDir,
    bits: u8,
    cloud: Vec<CloudPoint>,
}

impl Original {
    fn new(bits: u8) -> Original {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("sim").to_str().unwrap().to_owned();
        let (shots, deep) = (SHOTS.to_string(), bits.to_string());
        sheetlight(&["simulate", "--out", &out, "--width", "320", "--shots", &shots, "--bits", &deep, "--quiet"]);
        let mut original = Original { dir, bits, cloud: Vec::new() };
        original.cloud = original.scan(&original.recording(), &[]);
        assert!(original.cloud.len() > 1000, "{} points", original.cloud.len());
        original
    }
    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    fn recording(&self) -> PathBuf {
        self.at("sim/scan")
    }
    fn pictures(&self) -> Vec<Image> {
        (0..SHOTS)
            .map(|i| load(&self.recording().join(format!("laser_{i:04}.png")), Channel::Luma, self.bits).unwrap())
            .collect()
    }
    /// The recording with its pictures written anew by `write`, as files of another kind.
    fn written(&self, kind: &str, write: impl Fn(&Image, &Path)) -> PathBuf {
        let folder = self.at(&format!("as {kind}"));
        std::fs::create_dir(&folder).unwrap();
        std::fs::copy(self.recording().join("poses.json"), folder.join("poses.json")).unwrap();
        let meta = std::fs::read_to_string(self.recording().join("meta.json")).unwrap();
        std::fs::write(folder.join("meta.json"), meta.replace(".png", &format!(".{kind}"))).unwrap();
        for (i, image) in self.pictures().iter().enumerate() {
            write(image, &folder.join(format!("laser_{i:04}.{kind}")));
        }
        folder
    }
    fn args(&self, more: &[&str]) -> Vec<String> {
        let (station, out) = (self.at("sim/station"), self.at("out"));
        let mut args = vec!["scan".to_owned(), "--station".into(), station.to_str().unwrap().into()];
        args.extend(["--out", out.to_str().unwrap(), "--overlays", "0", "--quiet"].map(str::to_owned));
        if !more.contains(&"--on") {
            args.extend(["--on", "cpu"].map(str::to_owned));
        }
        args.extend(more.iter().map(|s| (*s).to_owned()));
        args
    }
    fn scan(&self, recording: &Path, more: &[&str]) -> Vec<CloudPoint> {
        let mut args = self.args(more);
        args.push(recording.to_str().unwrap().into());
        sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>());
        read_cloud(&self.at("out/cloud.ply")).unwrap()
    }
    /// Scans frames written to standard input; exit code, stderr and the cloud, if there is one.
    fn pipe(&self, bytes: &[u8], more: &[&str]) -> (bool, String, Vec<CloudPoint>) {
        std::fs::remove_dir_all(self.at("out")).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
            .args(self.args(more))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // A program that refuses the stream stops reading.
        let _ = child.stdin.take().unwrap().write_all(bytes);
        let done = child.wait_with_output().unwrap();
        let cloud = read_cloud(&self.at("out/cloud.ply")).unwrap_or_default();
        (done.status.success(), String::from_utf8_lossy(&done.stderr).into_owned(), cloud)
    }
    fn raw(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for image in self.pictures() {
            match image.pixels {
                Pixels::U8(p) => bytes.extend(p),
                Pixels::U16(p) => bytes.extend(p.iter().flat_map(|v| v.to_le_bytes())),
            }
        }
        bytes
    }
    fn poses(&self) -> String {
        self.recording().join("poses.json").to_str().unwrap().to_owned()
    }
}

fn levels(image: &Image) -> Vec<u16> {
    match &image.pixels {
        Pixels::U8(p) => p.iter().map(|&v| u16::from(v)).collect(),
        Pixels::U16(p) => p.clone(),
    }
}

fn grey(image: &Image) -> image::DynamicImage {
    match &image.pixels {
        Pixels::U8(p) => image::GrayImage::from_raw(image.width, image.height, p.clone()).unwrap().into(),
        Pixels::U16(p) => {
            image::ImageBuffer::<image::Luma<u16>, _>::from_raw(image.width, image.height, p.clone()).unwrap().into()
        }
    }
}

/// A binary PGM with the sensor's own largest level.
fn pgm(image: &Image, path: &Path) {
    let header = format!("P5\n# written by a test\n{} {}\n{}\n", image.width, image.height, image.full_scale());
    let mut all = header.into_bytes();
    match &image.pixels {
        Pixels::U8(p) => all.extend(p),
        Pixels::U16(p) => all.extend(p.iter().flat_map(|v| v.to_be_bytes())),
    }
    std::fs::write(path, all).unwrap();
}

#[test]
fn pictures_of_8_bits_in_every_format() {
    let o = Original::new(8);
    let tif = o.written("tif", |i, path| grey(i).save(path).unwrap());
    assert!(o.scan(&tif, &[]) == o.cloud, "TIFF");
    let pgm = o.written("pgm", pgm);
    assert!(o.scan(&pgm, &[]) == o.cloud, "PGM");
    // JPEG loses up to some grey levels even at its best: as many points, the same surface.
    let jpg = o.written("jpg", |i, path| {
        let file = std::fs::File::create(path).unwrap();
        grey(i).write_with_encoder(image::codecs::jpeg::JpegEncoder::new_with_quality(file, 100)).unwrap();
    });
    let cloud = o.scan(&jpg, &[]);
    let mean = |c: &[CloudPoint]| c.iter().map(|p| f64::from(p.position[2])).sum::<f64>() / c.len() as f64;
    assert!(cloud.len().abs_diff(o.cloud.len()) * 100 < o.cloud.len(), "JPEG: {} {}", cloud.len(), o.cloud.len());
    assert!((mean(&cloud) - mean(&o.cloud)).abs() < 0.01, "JPEG: {} {}", mean(&cloud), mean(&o.cloud));
}

#[test]
fn the_channel_of_a_colour_picture_is_a_choice() {
    let o = Original::new(8);
    for (k, name) in ["red", "green", "blue"].into_iter().enumerate() {
        let png = o.written(&format!("{name}.png"), |i, path| {
            let shown = levels(i);
            let colour = shown.iter().enumerate().flat_map(|(at, v)| {
                // The other two channels show it elsewhere.
                let below = |rows: usize| shown[(at + rows * SIZE.0 as usize) % shown.len()] as u8;
                let mut c = [below(17), below(29), below(43)];
                c[k] = *v as u8;
                c
            });
            image::RgbImage::from_raw(SIZE.0, SIZE.1, colour.collect()).unwrap().save(path).unwrap();
        });
        assert!(o.scan(&png, &["--channel", name]) == o.cloud, "{name}");
        assert!(o.scan(&png, &[]) != o.cloud, "luma of a picture that is not grey");
    }
    let same = o.written("grey.png", |i, path| grey(i).to_rgb8().save(path).unwrap());
    assert!(o.scan(&same, &[]) == o.cloud, "luma of grey");
}

#[test]
fn deep_pictures_and_raw_frames_in_every_depth() {
    for (bits, layout) in [(8, "gray8"), (10, "gray10le"), (12, "gray12le"), (16, "gray16le")] {
        let o = Original::new(bits);
        let (raw, poses, bytes) = (format!("{}x{}:{layout}", SIZE.0, SIZE.1), o.poses(), o.raw());
        let args = ["--raw", raw.as_str(), "--poses", poses.as_str()];
        let (good, text, cloud) = o.pipe(&bytes, &args);
        assert!(good && cloud == o.cloud, "{layout}: {} of {} points\n{text}", cloud.len(), o.cloud.len());
        if bits > 8 {
            let tif = o.written("tif", |i, path| grey(i).save(path).unwrap());
            assert!(o.scan(&tif, &[]) == o.cloud, "TIFF of {bits} bits");
            let pgm = o.written("pgm", pgm);
            assert!(o.scan(&pgm, &[]) == o.cloud, "PGM of {bits} bits");
        }
        if bits == 12 {
            // A pipe that ends inside a frame, another layout than the sender's, fewer poses than frames.
            let (good, text, _) = o.pipe(&bytes[..bytes.len() - 100], &args);
            assert!(!good && text.contains("153500 of 153600 bytes") && text.contains("next step"), "{text}");
            let ten = raw.replace("gray12le", "gray10le");
            let (good, text, _) = o.pipe(&bytes, &["--raw", &ten, "--poses", &poses]);
            assert!(!good && text.contains("above 1023 of 10 bits"), "{text}");
            let few = o.at("few.json");
            let all = sheetlight::recording::load_poses(Path::new(&poses)).unwrap().poses;
            sheetlight::recording::save_poses(&few, &all[..SHOTS - 3]).unwrap();
            let (good, text, _) = o.pipe(&bytes, &["--raw", &raw, "--poses", few.to_str().unwrap()]);
            assert!(!good && text.contains("more than 7 frames, the pose file has 7 poses"), "{text}");
            // Leaving shots out does not tell which pose belongs to which frame.
            let skip = ["--raw", &raw, "--poses", few.to_str().unwrap(), "--skip-bad"];
            let (good, text, _) = o.pipe(&bytes, &skip);
            assert!(!good && text.contains("frames were lost"), "{text}");
            // Two frames lost on the way: refused, and right where they are named.
            let frame = bytes.len() / SHOTS;
            let lost = [&bytes[..3 * frame], &bytes[4 * frame..7 * frame], &bytes[8 * frame..]].concat();
            let (good, text, _) = o.pipe(&lost, &args);
            assert!(!good && text.contains("gave 8 frames, the pose file has 10 poses"), "{text}");
            let (good, text, cloud) = o.pipe(&lost, &[args.as_slice(), &["--missing", "3,7"]].concat());
            let there = |p: &&CloudPoint| p.shot != 3 && p.shot != 7;
            let whole = o.cloud.iter().filter(there).count();
            assert!(good && cloud.iter().all(|p| there(&p)), "{text}");
            assert!(cloud.len().abs_diff(whole) * 50 < whole, "{} of {whole}", cloud.len());
        }
    }
}

#[test]
fn ambient_light_is_subtracted_on_request_and_only_if_it_fits() {
    let o = Original::new(8);
    fn leak(x: u32, y: u32) -> u8 {
        10 + ((x / 8 + y / 8) % 3) as u8 * 6
    }
    let light = image::GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| image::Luma([leak(x, y)]));
    // Every shot without and with the light in it, with room above: what saturates cannot be subtracted from.
    let write = |add: fn(u32, u32) -> u8| {
        move |i: &Image, path: &Path| {
            let level = |(at, v): (usize, u16)| {
                let (x, y) = (at as u32 % SIZE.0, at as u32 / SIZE.0);
                v.min(220) as u8 + add(x, y)
            };
            let px = levels(i).into_iter().enumerate().map(level).collect();
            image::GrayImage::from_raw(SIZE.0, SIZE.1, px).unwrap().save(path).unwrap();
        }
    };
    let dark = o.written("dark.png", write(|_, _| 0));
    let lit = o.written("lit.png", write(leak));
    light.save(lit.join("ambient.png")).unwrap();
    for place in ["cpu", "auto"] {
        let with = o.scan(&lit, &["--ambient", "ambient.png", "--on", place]);
        let plain = o.scan(&dark, &["--on", place]);
        assert!(with == plain && plain.len() > 1000, "{place}: {} and {} points", with.len(), plain.len());
        assert!(o.scan(&lit, &["--on", place]) != plain, "the light matters");
    }
    let fails = |file: &Path, want: &str| {
        let mut args = o.args(&["--ambient", file.to_str().unwrap()]);
        args.push(lit.to_str().unwrap().into());
        let (code, text) = sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(code == 1 && text.contains(want) && text.contains("next step"), "{text}");
    };
    let bright = o.at("bright.png");
    image::GrayImage::from_pixel(SIZE.0, SIZE.1, image::Luma([90])).save(&bright).unwrap();
    fails(&bright, "the ambient picture is brighter than laser_0000");
    let small = o.at("small.png");
    image::GrayImage::from_pixel(160, 120, image::Luma([9])).save(&small).unwrap();
    fails(&small, "is 160x120, it should be 320x240");
    let deep = o.at("deep.png");
    image::ImageBuffer::from_pixel(SIZE.0, SIZE.1, image::Luma([9u16])).save(&deep).unwrap();
    fails(&deep, "holds 16 bits a pixel, the recording declares 8");
    fails(&o.at("none.png"), "cannot be read");
}
