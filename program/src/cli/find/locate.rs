//! In: a scan folder and a recipe. Out: the insertion pose as JSON and in the robot's notation, its
//! uncertainty and error budget, a picture; or a refusal with its reasons.
//! Frame and unit: base frame; mm, degrees.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use crate::cli::terminal::surroundings::Typed;
use crate::procedure::{FindOrder, Located};
use sheetlight::fault::{Fault, Result};
use sheetlight::find::Report;
use sheetlight::find::look::looks::Disagreement;
use std::path::{Path, PathBuf};

/// Find a part in a scan and compute the insertion pose
///
/// If a gate of the recipe is missed there is no pose: the report names the gate, and the exit code is 1. One scan
/// cannot show errors of calibration, delay, convention or robot. With a second scan of the same part from another
/// side (sheetlight second-look plans it) the pose comes from both, and their disagreement is a gate. The report also
/// limits the errors that both scans could hide. A third scan, or distances of the pointer (--range), reveal more.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight find scans/board7 --recipe data/recipes/led.toml --station cell3 --out led.json
  sheetlight find scans/b7 scans/b7again --recipe led.toml --station cell3 --out led.json
  sheetlight find scans/b7 scans/b7again --range recordings/spots \\
      --recipe led.toml --station cell3 --out led.json
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    #[command(flatten)]
    order: FindOrder,
    /// File for the report (JSON); a picture (.png) is written beside it
    #[arg(long)]
    out: PathBuf,
    /// Station of the scan; its covariances enter the error budget
    #[arg(long)]
    station: Option<PathBuf>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let image = args.out.with_extension("png");
    let scans: Vec<&Path> = args.order.scans.iter().map(Path::new).collect();
    let inputs = Inputs { files: &[Path::new(&args.order.recipe)], scans: &scans, station: args.station.as_deref() };
    outputs::check(&[&args.out, &image], &inputs)?;
    let found = args.order.find(&Typed, args.station.as_deref(), true);
    let Located { report, picture, .. } = found.inspect_err(|_| outdated(&args.out, &image, console))?;
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    sheetlight::files::write_beside((&args.out, text.as_bytes()), &[(&image, &picture.to_png())])?;
    console.result(&report, &summary(&report));
    console.say(format!("see {} and {}", args.out.display(), image.display()));
    if report.passed {
        return Ok(());
    }
    Err(Fault::refused(format!("no pose: {}", report.reasons.join("; ")))
        .cause(if report.gates.iter().any(|g| !g.passed && g.name == "sizes' ratio") {
            "another part, a drawing in another unit, or a scan with a wrong scale"
        } else {
            "the part is hidden in part, another one, or too badly seen"
        })
        .next(format!("look at {}", image.display())))
}

/// Renames the report of an earlier search: a program that reads it would insert where the part was then.
fn outdated(report: &Path, picture: &Path, console: &Console) {
    for path in [report, picture].into_iter().filter(|path| path.is_file()) {
        let end = path.extension().unwrap_or_default().to_string_lossy();
        let former = path.with_extension(format!("former.{end}"));
        match std::fs::rename(path, &former) {
            Ok(()) => {
                console.warn(format!("{} is of an earlier search: it is now {}", path.display(), former.display()))
            }
            Err(e) => console.warn(format!("{} is of an earlier search ({e})", path.display())),
        }
    }
}

pub(super) fn summary(r: &Report) -> String {
    let mut s = format!("{}: {}\n", r.recipe, if r.passed { "found" } else { "refused" });
    if r.frame != "base" {
        s += &format!("frame        {}\n", r.frame);
    }
    s += &poses(r);
    s += &uncertainty(r);
    s += &seen(r);
    if let Some(z) = &r.sizes {
        s += &format!(
            "sizes        along the stripe {:+.3} %, from shot to shot {:+.3} %, difference {:+.3} %, shear {:+.4} \
             degrees against the \
             drawing; {:.3} {:.3} {:.3} {:.4} are expected\n",
            z.along_percent,
            z.across_percent,
            z.difference_percent,
            z.shear_deg,
            z.expected[0],
            z.expected[1],
            z.expected[2],
            z.expected[3]
        );
    }
    if let Some(l) = &r.looks {
        s += &looks(l);
    }
    for g in &r.gates {
        s += &format!(
            "gate         {:16} {:8.3}  limit {:.3}  {}\n",
            g.name,
            g.value,
            g.limit,
            if g.passed { "ok" } else { "MISSED" }
        );
    }
    for n in &r.notes {
        s += &format!("note         {n}\n");
    }
    s
}

/// The robot's poses, and whether the tolerance is met; empty without a pose.
fn poses(r: &Report) -> String {
    let mut s = String::new();
    let Some(p) = &r.poses else { return s };
    for (name, pose) in [("approach", &p.approach), ("insertion", &p.insertion), ("retract", &p.retract)] {
        let numbers: Vec<String> = pose.numbers.iter().map(|v| format!("{v:.4}")).collect();
        s += &format!("{name:12} {} ({}: {})\n", numbers.join(" "), pose.convention, pose.labels.join(", "));
    }
    s += &format!(
        "{:12} {} mm and {} degrees, {} at 3 sigma\n",
        "tolerance",
        r.tolerance_mm,
        r.tolerance_deg,
        if r.within_tolerance { "kept" } else { "NOT kept" }
    );
    s
}

/// Sigmas of the pose and their error budget.
fn uncertainty(r: &Report) -> String {
    let mut s =
        format!("{:12} {} mm, {} degrees (x y z of the part)\n", "sigma", row(&r.sigma_mm, 4), row(&r.sigma_deg, 4));
    for t in &r.budget.terms {
        let mm = t.sigma_mm.as_ref().map_or("-".into(), |v| row(v, 4));
        let deg = t.sigma_deg.as_ref().map_or("-".into(), |v| row(v, 4));
        s += &format!("  {:12} {mm} mm, {deg} degrees; {}\n", t.name, t.note);
    }
    if !r.budget.complete {
        s += "  the sum is a lower bound: a term is unknown\n";
    }
    s
}

/// How well the scan shows the part: the match, competing positions, its constructions.
fn seen(r: &Report) -> String {
    let mut s = format!(
        "match        score {:.3}, next best pose {:.3}; {} edges to {:.3} mm, {} surface points to {:.3} mm\n",
        r.found.score, r.found.second_score, r.edges, r.edge_rms_mm, r.surface_points, r.surface_rms_mm
    );
    for (k, p) in r.all.iter().enumerate() {
        s += &format!(
            "  place {:3}    {} mm, {:8.2} degrees, score {:.3}\n",
            k + 1,
            row(&p.at_mm, 2),
            p.angle_deg,
            p.score
        );
    }
    for c in &r.constructions {
        s += &format!(
            "  {:24} {:+.3} {:+.3} mm{} from where the pose puts it ({} shapes)\n",
            c.name,
            c.deviation_mm[0],
            c.deviation_mm[1],
            c.deviation_deg.map_or(String::new(), |d| format!(", {d:+.3} degrees")),
            c.shapes
        );
    }
    if let (Some(d), Some(noise)) = (r.disagreement_mm, r.disagreement_noise_mm) {
        s += &format!(
            "  the two-pin construction and the lattice fit disagree by {d:.3} mm; their noise explains {noise:.3} mm\n"
        );
    }
    s
}

fn row(v: &[f64; 3], digits: usize) -> String {
    v.map(|x| format!("{x:.digits$}")).join(" ")
}

/// The disagreement of several scans, in words.
pub fn looks(l: &Disagreement) -> String {
    let mut s = String::new();
    s += &format!(
        "looks        {} of them, turned by {:.0} and tilted by {:.0} degrees; looks {} and {} disagree by {} mm, {} \
         degrees; \
         {} mm, {} degrees are expected{}\n",
        l.looks,
        l.turn_deg,
        l.tilt_deg,
        l.between[0],
        l.between[1],
        row(&l.difference_mm, 4),
        row(&l.difference_deg, 4),
        row(&l.expected_mm, 4),
        row(&l.expected_deg, 4),
        if l.complete { "" } else { " at least (a calibration does not know its uncertainty)" }
    );
    for e in &l.explained_by {
        let off: Vec<String> = e.off_by.iter().map(|(name, by)| format!("{name} {by:+.3}")).collect();
        s += &format!(
            "  {:16} an error of {} would explain {:.0} % of the disagreement; an error of {:.0} sigmas could remain \
             undetected and move the part by up to {} mm\n",
            e.name,
            off.join(", "),
            100.0 * e.share,
            e.unnoticed_sigmas,
            row(&e.unseen_mm, 3)
        );
    }
    if let Some(w) = &l.witness {
        s += &format!(
            "  the pointer puts the surface {:+.4} mm above the looks' ({} places), {:.4} mm is expected\n",
            w.height_mm, w.places, w.expected_mm
        );
    }
    s
}
