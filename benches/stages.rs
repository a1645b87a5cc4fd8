//! In: pictures of the bench's scenes. Out: Criterion's times of the stripe chain and of its CPU twins.
//! Frame and unit: seconds a shot. What limits each stands beside it and in benches/README.md.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sheetlight::gpu::Device;
use sheetlight::raster::Image;
use sheetlight::scan::grid;
use sheetlight::scan::{CloudPoint, GridOptions, grid_on};
use sheetlight::stages::chain::batches::Chain;
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::stripe::{hough, skeleton, thin, threshold};
use sheetlight::stages::{Thinning, ThresholdParams};
use sheetlight_program::bench::{Scene, pictures};

/// The program's own.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

const THRESHOLD: ThresholdParams =
    ThresholdParams { window: sheetlight::stages::Window::Mean, size: 31, offset: 8, minimum: 0 };

fn twins(c: &mut Criterion) {
    let image = &pictures(Scene::OneStripe, 1280, 960, 1)[0];
    let lit = threshold::twin(image, &THRESHOLD);
    let thinned = thin::twin(&lit, Thinning::ZhangSuen);
    let pixels = skeleton::twin(&thinned);
    let mut group = c.benchmark_group("twins 1280x960");
    group.throughput(Throughput::Elements(1280 * 960));
    // Limited by the running sums: four dependent additions a pixel on one core.
    group.bench_function("threshold", |b| b.iter(|| threshold::twin(image, &THRESHOLD)));
    // Limited by the passes over words that are dark: one comparison each.
    group.bench_function("thin", |b| b.iter(|| thin::twin(&lit, Thinning::ZhangSuen)));
    // Limited by reading the mask.
    group.bench_function("skeleton", |b| b.iter(|| skeleton::twin(&thinned)));
    let frame = hough::HoughFrame::new(1280, 960, &hough::HoughParams::default());
    // Limited by scattered additions: one cache miss a vote.
    group.bench_function("hough votes", |b| b.iter(|| hough::votes(&frame, &pixels)));
    group.finish();
}

fn chain(c: &mut Criterion) {
    let Ok(device) = Device::open() else {
        eprintln!("SKIPPED, no GPU adapter");
        return;
    };
    for (width, height) in [(640, 480), (1280, 960), (4096, 3072)] {
        let config = ChainConfig { threshold: THRESHOLD, ..ChainConfig::new(width, height, 8).on(&device) };
        let images = pictures(Scene::OneStripe, width, height, config.shots);
        let refs: Vec<&Image> = images.iter().collect();
        let mut chain = Chain::new(&device, &config).expect("the sizes fit every adapter");
        let mut group = c.benchmark_group("chain");
        group.sample_size(20);
        group.throughput(Throughput::Elements(u64::from(width * height * config.shots)));
        // Limited, on a software adapter, by the upload and the statistics, which touch every pixel; on a discrete
        // GPU by the bus.
        group.bench_function(format!("{width}x{height}, batches of {}", config.shots), |b| {
            b.iter(|| {
                chain.submit(0, &refs).expect("the device is there");
                chain.collect(true).expect("the device is there")
            })
        });
        group.finish();
    }
}

/// A tilted surface of 300,000 points, gridded.
fn clouds(c: &mut Criterion) {
    let points: Vec<CloudPoint> = (0..300_000u32)
        .map(|i| {
            let (x, y) = (0.1 * (i % 600) as f32, 0.1 * (i / 600) as f32);
            CloudPoint {
                position: [400.0 + x, y, 0.2 * x].into(),
                sigma_mm: 0.02,
                intensity: 90.0,
                quality: 1.0,
                ..Default::default()
            }
        })
        .collect();
    let options = GridOptions { cell: Some(0.25), ..GridOptions::default() };
    let mut group = c.benchmark_group("height map of 300,000 points");
    group.sample_size(20);
    // Limited by finding the best plane, then by one scattered access a point and pass.
    group.bench_function("twin", |b| b.iter(|| grid(&points, &options).expect("a surface")));
    if let Ok(device) = Device::open() {
        // Limited, on a software adapter, by six atomic operations a point; on a discrete GPU by the bus.
        group.bench_function("GPU", |b| b.iter(|| grid_on(&points, &options, Some(&device)).expect("a surface")));
    }
    group.finish();
}

criterion_group!(benches, twins, chain, clouds);
criterion_main!(benches);
