//! In: on stdin one JSON line of settings, raw 8-bit pictures, then commands. Out: on stdout one JSON line for each
//! answer, raw masks and points. Another program times its chain against this one on the same pictures, in turns.
//! Frame and unit: pixels; points in the camera's frame, mm; seconds.

use super::machine;
use rayon::prelude::*;
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Plane, Vec3};
use sheetlight::gpu::Device;
use sheetlight::raster::Image;
use sheetlight::scan::{Engine, Extraction, Format, Optical, Processor};
use sheetlight::stages::chain::batches::{Batch, Chain};
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::chain::measure::Measure;
use sheetlight::stages::host::Host;
use sheetlight::stages::peak::params::{Method, PeakParams};
use sheetlight::stages::peak::{Stripe, noise};
use sheetlight::stages::stripe::choose_params::ChooseParams;
use sheetlight::stages::stripe::point::{FLAT, Optics};
use sheetlight::stages::{ThresholdParams, Window};
use std::io::{BufRead, Write};
use std::time::Instant;

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Setup {
    width: u32,
    height: u32,
    count: usize,
    shots_per_batch: u32,
    size: u32,
    offset: i32,
    #[serde(default)]
    minimum: u16,
    /// fx, fy, cx, cy, skew; px.
    pinhole: [f32; 5],
    /// k1, k2, p1, p2, k3.
    distortion: [f32; 5],
    /// Laser plane: normal · X = offset, mm.
    normal: [f32; 3],
    offset_mm: f32,
    /// Sigma of the stripe, px; if omitted it is measured from the pictures as in a scan.
    width_px: Option<f32>,
}

/// Accepts all depths, so that nothing is excluded while the stripe is measured, mm.
const DEPTH_MM: [f64; 2] = [1.0, 1e5];
/// A fixed pose: all points stay in the camera frame.
const STILL: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

#[derive(serde::Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Command {
    /// Runs all pictures this many times, several batches in flight, with a point for the middle of every skeleton
    /// pixel.
    Run(usize),
    /// As `Run`, with the settings of a scan: peaks, their standard deviations and all rejection reasons.
    RunFull(usize),
    /// As `RunFull` on this machine's processor: all pictures at once (`RunHost`), or one after the other
    /// (`RunHostSingly`).
    RunHost(usize),
    RunHostSingly(usize),
    /// x, y of the skeleton pixels of one picture and X, Y, Z of their points, little-endian f32, preceded by their
    /// number in JSON.
    Points(usize),
    /// The thresholded and the thinned mask of one picture, 0 and 255.
    Masks(usize),
    Quit,
}

fn broken(what: impl std::fmt::Display) -> Fault {
    Fault::input(format!("peer: {what}"))
        .cause("the other program and this one speak different versions")
        .next("build both from the same commit")
}

/// Serves one peer until it sends `quit` or closes the pipe.
pub fn serve(device: &Device, mut input: impl BufRead, mut output: impl Write) -> Result<()> {
    let mut line = String::new();
    input.read_line(&mut line).map_err(lost)?;
    let setup: Setup = serde_json::from_str(&line).map_err(broken)?;
    let mut images = Vec::new();
    for _ in 0..setup.count {
        let mut pixels = vec![0; setup.width as usize * setup.height as usize];
        input.read_exact(&mut pixels).map_err(lost)?;
        images.push(Image::from_u8(setup.width, setup.height, pixels));
    }
    let mut ours = Ours::new(device, &setup, images)?;
    writeln!(output, "{}", serde_json::json!({"ready": device.info.name, "width_px": ours.width_px})).map_err(lost)?;
    output.flush().map_err(lost)?;
    loop {
        line.clear();
        if input.read_line(&mut line).map_err(lost)? == 0 {
            return Ok(());
        }
        match serde_json::from_str(&line).map_err(broken)? {
            Command::Quit => return Ok(()),
            Command::Points(i) => ours.points(i, &mut output)?,
            Command::Masks(i) => ours.masks(i, &mut output)?,
            command @ (Command::Run(times)
            | Command::RunFull(times)
            | Command::RunHost(times)
            | Command::RunHostSingly(times)) => {
                let answer = ours.timed(&command, times)?;
                writeln!(output, "{answer}").map_err(lost)?;
            }
        }
        output.flush().map_err(lost)?;
    }
}

fn lost(e: std::io::Error) -> Fault {
    broken(e)
}

fn format(setup: &Setup) -> Format {
    Format { width: setup.width, height: setup.height, bits: 8 }
}

/// Measures the stripe as a scan with this camera and laser plane does before its first profile.
fn learned(setup: &Setup, images: &[Image]) -> Result<Stripe> {
    let [fx, fy, cx, cy, skew] = setup.pinhole.map(f64::from);
    let terms = setup.distortion.map(f64::from);
    let normal = Vec3::from(setup.normal.map(f64::from));
    let (width, height) = (setup.width, setup.height);
    let optical = Optical {
        camera: Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
            distortion: Distortion::from_opencv(&terms).expect("five terms"),
            width,
            height,
        },
        laser: Plane::new(normal, f64::from(setup.offset_mm)).ok_or_else(|| broken("the plane's normal is zero"))?,
        depth_mm: DEPTH_MM,
    };
    let engine = Engine::new(format(setup), &optical, &Extraction::default(), None, Processor::host());
    let seen = engine.measure(&images.iter().collect::<Vec<_>>());
    Ok(seen.ok_or_else(|| broken("no picture shows enough of a stripe to learn its width"))?.stripe)
}

/// The peer's pictures, and this program's chains with the peer's settings.
struct Ours {
    images: Vec<Image>,
    /// Chains with a point for the middle of every skeleton pixel: in batches, and one picture at a time.
    chain: Chain,
    single: Chain,
    /// Chains with the settings of a scan: on the device, and on the processor.
    full: Chain,
    host: Host,
    width_px: f32,
}

impl Ours {
    /// Compiles all chains, and runs those once that will be timed on the device.
    fn new(device: &Device, setup: &Setup, images: Vec<Image>) -> Result<Ours> {
        let optics = Optics {
            pinhole: setup.pinhole,
            distortion: std::array::from_fn(|i| setup.distortion.get(i).copied().unwrap_or(0.0)),
            untilt: FLAT,
            normal: setup.normal.into(),
            offset: setup.offset_mm,
        };
        let stripe = match setup.width_px {
            Some(width_px) => Stripe { width_px, noise: noise(&images[0]), ..Stripe::default() },
            None => learned(setup, &images)?,
        };
        let peak = PeakParams { width_px: stripe.width_px, ..PeakParams::default() };
        // No peak is rejected, as in the other program.
        let pixels =
            Measure { peak: PeakParams { method: Method::Pixel, ..peak }, choose: ChooseParams::lenient(), optics };
        let config = ChainConfig {
            shots: setup.shots_per_batch,
            measure: Some(pixels),
            threshold: ThresholdParams {
                window: Window::Mean,
                size: setup.size,
                offset: setup.offset,
                minimum: setup.minimum,
            },
            ..ChainConfig::new(setup.width, setup.height, 8)
        };
        let mut chain = Chain::new(device, &config)?;
        run(&mut chain, &images, 1)?;
        let single = Chain::new(device, &ChainConfig { shots: 1, slots: 1, ..config })?;
        let scan = Extraction::default().for_stripe(&stripe).chain(format(setup), optics, stripe.width_px);
        let host = Host::new(&scan)?;
        let mut full = Chain::new(device, &ChainConfig { shots: setup.shots_per_batch, ..scan })?;
        run(&mut full, &images, 1)?;
        Ok(Ours { images, chain, single, full, host, width_px: stripe.width_px })
    }

    /// Time in seconds of all pictures, `times` times, on the chain that the command names.
    fn timed(&mut self, command: &Command, times: usize) -> Result<serde_json::Value> {
        let (cpu, start) = (machine::cpu_seconds(), Instant::now());
        let points = match command {
            Command::Run(_) => run(&mut self.chain, &self.images, times)?,
            Command::RunFull(_) => run(&mut self.full, &self.images, times)?,
            _ => run_host(&self.host, &self.images, times, matches!(command, Command::RunHost(_)))?,
        };
        let wall = start.elapsed().as_secs_f64();
        let cpu = cpu.and_then(|c| Some(machine::cpu_seconds()? - c));
        Ok(serde_json::json!({"wall_s": wall, "cpu_s": cpu, "shots": times * self.images.len(), "points": points}))
    }

    fn points(&mut self, i: usize, output: &mut impl Write) -> Result<()> {
        self.single.submit_posed(0, &[&self.images[i]], &[STILL])?;
        let mut batch = Batch::default();
        self.single.collect_into(true, &mut batch)?;
        writeln!(output, "{}", serde_json::json!({"points": batch.points.len()})).map_err(lost)?;
        for (k, p) in batch.peaks.iter().zip(&batch.points) {
            let [x, y, z] = p.position.to_array();
            let row = [(k.pixel & 0xffff) as f32, (k.pixel >> 16) as f32, x, y, z];
            output.write_all(&row.map(f32::to_le_bytes).concat()).map_err(lost)?;
        }
        Ok(())
    }

    fn masks(&mut self, i: usize, output: &mut impl Write) -> Result<()> {
        self.single.submit_posed(0, &[&self.images[i]], &[STILL])?;
        self.single.collect(true)?;
        output.write_all(&self.single.lit(0)?.to_u8()).map_err(lost)?;
        output.write_all(&self.single.mask(0)?.to_u8()).map_err(lost)
    }
}

/// As [`run`], on the processor.
fn run_host(host: &Host, images: &[Image], times: usize, at_once: bool) -> Result<usize> {
    let one = |image: &Image| Ok(host.run(0, image, &STILL)?.points.len());
    let mut points = 0;
    for _ in 0..times {
        points += if at_once {
            images.par_iter().map(one).sum::<Result<usize>>()?
        } else {
            images.iter().map(one).sum::<Result<usize>>()?
        };
    }
    Ok(points)
}

/// Runs all pictures; returns the number of points.
fn run(chain: &mut Chain, images: &[Image], times: usize) -> Result<usize> {
    let order: Vec<&Image> = (0..times).flat_map(|_| images).collect();
    let (mut points, mut done) = (0, Batch::default());
    for batch in order.chunks(chain.frame.shots as usize) {
        if !chain.has_room() && chain.collect_into(true, &mut done)? {
            points += done.points.len();
        }
        chain.submit_posed(0, batch, &[STILL].repeat(batch.len()))?;
    }
    while chain.collect_into(true, &mut done)? {
        points += done.points.len();
    }
    Ok(points)
}
