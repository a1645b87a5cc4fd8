//! Compares the chain of a scan with the chain that `sheetlight bench` and the peers time, on simulated pictures of
//! every scene: points, wall and CPU time (ms a shot), in turns, on the processor and on the GPU. A scan learns the
//! stripe from its first pictures; the other chain gets its width.
//! `cargo bench --bench scan_chain -- [WIDTHxHEIGHT]... [ROUNDS]`

mod common;

use common::median;
use rayon::prelude::*;
use sheetlight::camera::Intrinsics;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Plane, Vec3};
use sheetlight::gpu::Device;
use sheetlight::raster::Image;
use sheetlight::scan::{Engine, Extraction, Format, Optical, Place, StripeSeen, Where};
use sheetlight::stages::chain::batches::{Batch, Chain};
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::host::Host;
use sheetlight::stages::peak::{Stripe, noise};
use sheetlight::stages::stripe::point::{Optics, pose_words};
use sheetlight_program::bench::{Scene, cpu_seconds, pictures, scan_chain};

/// The program's own.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Pictures that the stripe is measured in, as in a scan.
const MEASURED: usize = 8;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let (rounds, sizes): (Vec<_>, Vec<_>) = args.iter().partition(|a| a.parse::<usize>().is_ok());
    let rounds = rounds.first().map_or(7, |n| n.parse().expect("a number"));
    let size = |word: &&String| -> Option<(u32, u32)> {
        let (width, height) = word.split_once('x')?;
        Some((width.parse().ok()?, height.parse().ok()?))
    };
    let sizes = sizes.iter().map(|word| size(word).expect("WIDTHxHEIGHT")).collect::<Vec<_>>();
    let sizes = if sizes.is_empty() { vec![(640, 480), (4096, 3072)] } else { sizes };
    println!("points a shot; ms a shot, wall and CPU; medians of {rounds} rounds, ratios within a round");
    for (width, height) in sizes {
        for scene in Scene::ALL {
            for way in [Where::Cpu, Where::Gpu] {
                if let Err(fault) = row(scene, (width, height), way, rounds) {
                    eprintln!("{fault}");
                    std::process::exit(1);
                }
            }
        }
    }
}

fn row(scene: Scene, (width, height): (u32, u32), way: Where, rounds: usize) -> Result<()> {
    let on = if way == Where::Gpu { "GPU" } else { "CPU" };
    let images = pictures(scene, width, height, if width * height < 1 << 20 { 32 } else { 8 });
    // Enough for a tenth of a second.
    let turns = (if width * height < 1 << 20 { 16 } else { 2 }) * if way == Where::Gpu { 1 } else { 4 };
    let shots: Vec<&Image> = (0..turns).flat_map(|_| &images).collect();
    let mut scan = of_scan(scene, &images, way)?;
    let mut bench = Bench::new(scene, &images[0], way)?;
    // An engine takes its pictures over, as they come from a camera or a file.
    let mut learnt = |shots: Vec<Image>| -> Result<usize> {
        let (mut points, place) = (0, Place::camera());
        let mut count = |done: Vec<sheetlight::scan::Measured>| {
            points += done.iter().flat_map(|m| &m.points).filter(|p| !p.sigma_mm.is_nan()).count();
        };
        for (i, image) in (0..).zip(shots) {
            scan.submit(i, image, place)?;
            count(scan.collect(false)?);
        }
        count(scan.collect(true)?);
        Ok(points)
    };
    let copies = || shots.iter().map(|&image| image.clone()).collect::<Vec<_>>();
    // Compiles and touches everything once.
    let points = [learnt(copies())?, bench.run(&shots)?].map(|n| n as f64 / shots.len() as f64);
    let mut round = || -> Result<[[f64; 2]; 2]> {
        let copies = copies();
        Ok([cost(|| learnt(copies))?, cost(|| bench.run(&shots))?])
    };
    let costs: Vec<_> = (0..rounds).map(|_| round()).collect::<Result<_>>()?;
    let ms = |which: usize, part: usize| 1e3 * median(&costs, |c| c[which][part]) / shots.len() as f64;
    println!(
        "{width}x{height} {:16} {on}: scan {:7.0}, {:8.3}, {:8.3}; bench {:7.0}, {:8.3}, {:8.3}; wall {:.2}, CPU {:.2}",
        scene.name(),
        points[0],
        ms(0, 0),
        ms(0, 1),
        points[1],
        ms(1, 0),
        ms(1, 1),
        median(&costs, |c| c[0][0] / c[1][0]),
        median(&costs, |c| c[0][1] / c[1][1]),
    );
    Ok(())
}

/// A scan's engine after its first pictures.
fn of_scan(scene: Scene, images: &[Image], way: Where) -> Result<Engine> {
    let format = Format { width: images[0].width, height: images[0].height, bits: 8 };
    let Optics { pinhole: [fx, fy, cx, cy, skew], distortion: d, normal, offset, .. } =
        scene.optics(format.width, format.height);
    let [fx, fy, cx, cy, skew] = [fx, fy, cx, cy, skew].map(f64::from);
    let distortion = [d[0], d[1], d[2], d[3], d[4]].map(f64::from).into();
    let laser = Plane::new(Vec3::from(normal.as_dvec3().to_array()), offset.into());
    let optical = Optical {
        camera: Intrinsics { fx, fy, cx, cy, skew, distortion, width: format.width, height: format.height },
        laser: laser.ok_or_else(|| Fault::input("a scene without a laser plane"))?,
        // All that the pictures show.
        depth_mm: [1.0, 1e5],
    };
    let mut engine = Engine::new(format, &optical, &Extraction::default(), None, way.open()?);
    let first: Vec<&Image> = images.iter().take(MEASURED).collect();
    let assumed = || StripeSeen::assumed(Stripe { noise: noise(&images[0]), ..Stripe::default() });
    let seen = engine.measure(&first).unwrap_or_else(assumed);
    engine.set_stripe(&seen.stripe)?;
    engine.set_hot(seen.hot);
    Ok(engine)
}

/// The chain that is told its stripe.
enum Bench {
    Host(Box<Host>),
    Gpu(Box<Chain>),
}

impl Bench {
    fn new(scene: Scene, image: &Image, way: Where) -> Result<Bench> {
        let config = scan_chain(image.width, image.height, scene, noise(image));
        if way == Where::Cpu {
            return Ok(Bench::Host(Box::new(Host::new(&config)?)));
        }
        let device = Device::open()?;
        let config: ChainConfig = config.on(&device);
        Ok(Bench::Gpu(Box::new(Chain::new(&device, &config)?)))
    }

    /// Points of all shots.
    fn run(&mut self, shots: &[&Image]) -> Result<usize> {
        let still = pose_words(&Place::camera().from_camera);
        let kept = |points: &[sheetlight::stages::stripe::point::Point]| {
            points.iter().filter(|p| !p.sigma_mm.is_nan()).count()
        };
        match self {
            Bench::Host(host) => shots.par_iter().map(|image| Ok(kept(&host.run(0, image, &still)?.points))).sum(),
            Bench::Gpu(chain) => {
                let (mut points, mut done) = (0, Batch::default());
                for batch in shots.chunks(chain.frame.shots as usize) {
                    if !chain.has_room() && chain.collect_into(true, &mut done)? {
                        points += kept(&done.points);
                    }
                    chain.submit_posed(0, batch, &[still].repeat(batch.len()))?;
                }
                while chain.collect_into(true, &mut done)? {
                    points += kept(&done.points);
                }
                Ok(points)
            }
        }
    }
}

/// CPU time of this process; NaN where the system does not tell.
fn cost(work: impl FnOnce() -> Result<usize>) -> Result<[f64; 2]> {
    common::cost(|| cpu_seconds().unwrap_or(f64::NAN), || work().map(drop))
}
