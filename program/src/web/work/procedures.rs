//! In: an order. Out: its result, from the procedure of `station` that executes it.
//! Frame and unit: as the procedures.

use super::find::labels;
use super::run::Run;
use super::{calibrate, check, find, insert, scan, tune};
use crate::bench::{WayTime, keep_up, recorded, way_times};
use crate::web::message::{BenchRow, KeptUp, Order, Outcome, SquareProposed, SurfaceTouched, TouchOrder, Touched};
use sheetlight::fault::Result;
use sheetlight::geometry::Vec3;
use sheetlight::gpu::Device;
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::Settings;

/// Frame rate of a camera whose drops are counted, Hz; and the duration at each size, s.
const RATE_HZ: f64 = 30.0;
const SECONDS: f64 = 2.0;

/// Executes an order.
pub(super) fn run(this: &Run, order: &Order) -> Result<Outcome> {
    match order {
        Order::Check(_) => check::check(this),
        Order::Scan(ask) => scan::scan(this, ask),
        Order::Filter(ask) => scan::filter(this, ask),
        Order::Find(ask) => find::find(this, ask),
        Order::Teach(ask) => find::teach(this, ask),
        Order::Touch(ask) => touch(this, ask),
        Order::Tune(_) => tune::tune(this),
        Order::Calibrate(ask) => calibrate::calibrate(this, ask),
        Order::Joint(ask) => calibrate::joint(this, ask),
        Order::Auto(ask) => calibrate::auto(this, ask),
        Order::Insert(ask) => insert::insert(this, ask),
        Order::Benchmark(ask) => benchmark(this, ask.rate_hz),
    }
}

fn touch(this: &Run, order: &TouchOrder) -> Result<Outcome> {
    let settings = Settings::load(&this.jobs.place.station)?;
    let (report, remarks) = this.remarked(|at| order.measure(at, &settings, true))?;
    let surface = report.surface.map(|s| SurfaceTouched {
        normal: s.normal,
        centre_mm: s.centre_mm,
        tilt_sigma_deg: s.tilt_sigma_deg,
        rms_mm: s.rms_mm,
        tilt_deg: Vec3::from(s.normal).angle(&Vec3::z()).to_degrees(),
        left_out: s.left_out,
    });
    let convention = settings.robot.unwrap_or(Convention::Matrix);
    let square = report.square.map(|q| SquareProposed {
        tilt_deg: q.tilt_deg,
        tilt_sigma_deg: q.tilt_sigma_deg,
        convention: convention.name().into(),
        labels: labels(convention),
        flange: convention.write(&q.base_from_flange),
        tool: convention.write(&q.base_from_tool),
    });
    let spots = report.distances.into_iter().map(|d| (d.picture, d.along_axis_mm, d.along_axis_sigma_mm)).collect();
    Ok(Outcome::Touch(Box::new(Touched {
        spots,
        surface,
        square,
        missing: report.missing,
        remarks: [report.remarks, remarks].concat(),
    })))
}

fn benchmark(this: &Run, rate_hz: Option<f64>) -> Result<Outcome> {
    this.progress(0, Some(2));
    let kept_up = keep_up(rate_hz.unwrap_or(RATE_HZ), SECONDS, Where::default())?;
    this.progress(1, Some(2));
    let device = Device::open().ok();
    let row = |w: WayTime| BenchRow { on: w.on, width: w.width, height: w.height, ms_per_shot: w.ms_per_shot };
    let rows = way_times(device.as_ref())?.into_iter().map(row).collect();
    let kept_up = kept_up.into_iter().map(|k| KeptUp {
        on: k.on,
        width: k.width,
        height: k.height,
        rate_hz: k.rate_hz,
        sent: k.sent,
        measured: k.measured,
        passed_over: k.passed_over,
        lost: k.lost,
        ms: k.ms,
    });
    Ok(Outcome::Benchmark { rows, recorded: recorded().into_iter().map(row).collect(), kept_up: kept_up.collect() })
}
