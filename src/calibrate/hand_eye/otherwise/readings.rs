//! Another notation in which the robot's poses would fit the pictures. Angles between poses do not depend on the
//! camera's mount, so most notations are ruled out before any transform is solved for.

use super::explanation::Explanation;
use super::positions::{Form, Unit};
use super::present::{Fits, Present};
use super::reading::{Orientation, Reading};
use crate::calibrate::hand_eye::chance::misfit;
use crate::calibrate::hand_eye::closed::{Pair, robot_scale};
use crate::calibrate::hand_eye::options::Mount;
use crate::geometry::{Base, Flange, Mat3, Rigid, Vec3, log, orthonormalise};
use crate::robot::{Convention, Written};

/// Smallest factor by which another notation must improve the fit over the stated one. Correct sets stay far below
/// it: noise remains in every notation.
const BETTER: f64 = 3.0;
/// Notations are dropped if their rotation misfit to the camera exceeds the best one's by this factor plus this
/// amount, rad.
const WORSE: f64 = 3.0;
const FINE: f64 = 0.01;
/// Number of readings of rotations, and of complete poses, that are examined closely.
const MOST_ROTATIONS: usize = 24;
const MOST_POSES: usize = 6;
/// Number of pairs of poses that are compared.
const MOST_LINKS: usize = 200;
/// Relative difference between misfits below which two notations count as equivalent.
const SAME: f64 = 1e-4;
/// Notations that fit this many times worse than the best one are not reported.
const RIVAL: f64 = 1.5;

/// One way to read the poses of a set.
#[derive(Clone, Copy, PartialEq)]
struct Notation {
    reading: Reading,
    /// The file contains the transpose of the rotation.
    transposed: bool,
    /// The file contains flange_from_base.
    inverted: bool,
    form: Form,
    unit: Unit,
}

/// The pairs with the numbers that their poses were read from.
struct Numbers<'a> {
    now: &'a Present<'a>,
    mount: Mount,
    convention: Convention,
    written: Vec<Written>,
    /// True if the numbers come from a file; false if from a network connection, where no notation is in doubt.
    of_file: bool,
}

/// Two poses and the camera's motion between them.
struct Link {
    i: usize,
    j: usize,
    /// Rotation vector of the camera's motion, rad.
    camera: Vec3,
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::INFINITY)
}

impl<'a> Numbers<'a> {
    fn of(now: &'a Present<'a>, mount: Mount) -> Option<Numbers<'a>> {
        let file: Option<Vec<Written>> = now.pairs.iter().map(|p| p.written.clone()).collect();
        let of_file = file.is_some();
        let written = file.unwrap_or_else(|| {
            now.pairs.iter().map(|p| Written::matrix(&mount.base_from_flange(&p.near_from_far))).collect()
        });
        let convention = written.first()?.convention;
        let whole = written.iter().all(|w| w.convention == convention && w.numbers.len() == convention.labels().len());
        whole.then_some(Numbers { now, mount, convention, written, of_file })
    }

    /// The notation in which the poses were read.
    fn as_read(&self) -> Notation {
        Notation {
            reading: Reading::of(self.convention),
            transposed: false,
            inverted: false,
            form: Form::PLAIN,
            unit: Unit::of(self.convention),
        }
    }

    fn position(&self, k: usize) -> Vec3 {
        let n = &self.written[k].numbers;
        let raw = if self.convention == Convention::Matrix { [n[3], n[7], n[11]] } else { [n[0], n[1], n[2]] };
        Vec3::from(raw) * Unit::of(self.convention).mm
    }

    fn links(&self) -> Vec<Link> {
        let n = self.written.len();
        let all: Vec<(usize, usize)> = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        let step = all.len().div_ceil(MOST_LINKS).max(1);
        let board = |k: usize| self.now.pairs[k].seen.camera_from_board.rotation;
        let link = |(i, j): (usize, usize)| Link { i, j, camera: log(&(board(i) * board(j).transpose())) };
        all.into_iter().step_by(step).map(link).collect()
    }

    fn rotations(&self, reading: &Reading) -> Option<Vec<Mat3>> {
        self.written.iter().map(|w| reading.rotation(w)).collect()
    }

    /// The pairs read in another notation; lengths as read, times `scale`.
    fn read(&self, n: &Notation, rotations: &[Mat3], scale: f64) -> Vec<Pair> {
        let pose = |(k, r): (usize, &Mat3)| {
            let rotation = if n.transposed { r.transpose() } else { *r };
            let pose = Rigid::<Base, Flange>::new(rotation, n.form.of(&self.position(k)) * scale);
            let i = pose.inverse();
            let pose = if n.inverted { Rigid::new(i.rotation, i.translation) } else { pose };
            self.now.pairs[k].at(self.mount.near_from_far(&pose))
        };
        rotations.iter().enumerate().map(pose).collect()
    }
}

/// Rotations of all poses under one reading that is consistent with the camera's rotations.
struct Turning {
    reading: Reading,
    rotations: Vec<Mat3>,
    /// True if near_from_far has the transposed rotations; false if it has these.
    transposed: bool,
    /// Median misfit of the rotations between poses to the camera's, rad.
    off: f64,
    /// Poses that agree with the others.
    agreeing: Vec<usize>,
}

/// Readings of rotations, the best first.
fn turnings(numbers: &Numbers<'_>) -> Vec<Turning> {
    let links = numbers.links();
    let own = [Reading::of(numbers.convention)];
    let all = if numbers.of_file { Reading::all(numbers.convention) } else { own.to_vec() };
    // The sine of half the angle between two rotations is invariant to a common rotation of all of them.
    let sine = |a: &Mat3, b: &Mat3| (a - b).norm() / 8f64.sqrt();
    let camera: Vec<f64> = links.iter().map(|l| (l.camera.norm() / 2.0).sin()).collect();
    let mut kept: Vec<(Reading, Vec<Mat3>, Vec<f64>, f64)> = Vec::new();
    for reading in all {
        let Some(rotations) = numbers.rotations(&reading) else { continue };
        let off: Vec<f64> =
            links.iter().zip(&camera).map(|(l, c)| 2.0 * (sine(&rotations[l.i], &rotations[l.j]) - c).abs()).collect();
        let middle = median(off.iter().copied());
        kept.push((reading, rotations, off, middle));
    }
    let best = kept.iter().map(|k| k.3).fold(f64::INFINITY, f64::min);
    kept.retain(|k| k.3 <= WORSE * best + FINE);
    let mut found: Vec<Turning> = Vec::new();
    for (reading, rotations, off, middle) in kept {
        let good: Vec<&Link> =
            links.iter().zip(&off).filter(|(_, o)| **o <= WORSE * middle + FINE).map(|(l, _)| l).collect();
        let agrees = |k: usize| {
            let with = |all: &mut dyn Iterator<Item = &Link>| all.filter(|l| l.i == k || l.j == k).count();
            2 * with(&mut good.iter().copied()) > with(&mut links.iter())
        };
        let agreeing: Vec<usize> = (0..rotations.len()).filter(|&k| agrees(k)).collect();
        for transposed in [false, true] {
            let near = |k: usize| if transposed { rotations[k].transpose() } else { rotations[k] };
            let robot: Vec<Vec3> = good.iter().map(|l| log(&(near(l.i) * near(l.j).transpose()))).collect();
            let m: Mat3 = robot.iter().zip(&good).map(|(a, l)| a * l.camera.transpose()).sum();
            let x = orthonormalise(&m);
            let off = median(robot.iter().zip(&good).map(|(a, l)| (a - x * l.camera).norm()));
            let (rotations, agreeing) = (rotations.clone(), agreeing.clone());
            found.push(Turning { reading, rotations, transposed, off, agreeing });
        }
    }
    let best = found.iter().map(|t| t.off).fold(f64::INFINITY, f64::min);
    found.retain(|t| t.off <= WORSE * best + FINE);
    found.sort_by(|a, b| a.off.total_cmp(&b.off));
    found.truncate(MOST_ROTATIONS);
    found
}

/// A notation with its pairs and their misfit, mm.
struct Candidate {
    notation: Notation,
    pairs: Vec<Pair>,
    rms: f64,
}

/// Candidate positions for these rotations.
fn candidates(numbers: &Numbers<'_>, t: &Turning) -> Vec<Candidate> {
    let mut out = Vec::new();
    // Either the rotation is transposed or the pose is inverted: rotations alone do not show which.
    let near_is_transposed = numbers.mount == Mount::EyeInHand;
    for inverted in [false, true] {
        let transposed = (t.transposed == near_is_transposed) == inverted;
        for form in Form::all().filter(|f| numbers.of_file || *f == Form::PLAIN) {
            let read = Unit::of(numbers.convention);
            let mut notation = Notation { reading: t.reading, transposed, inverted, form, unit: read };
            if transposed && !numbers.of_file {
                continue;
            }
            let chosen = |pairs: &[Pair]| -> Vec<Pair> { t.agreeing.iter().map(|&k| pairs[k].clone()).collect() };
            let some = chosen(&numbers.read(&notation, &t.rotations, 1.0));
            let Some(unit) = robot_scale(&some.iter().collect::<Vec<_>>()).and_then(|s| read.times(s)) else {
                continue;
            };
            notation.unit = unit;
            let pairs = numbers.read(&notation, &t.rotations, unit.mm / read.mm);
            let some = chosen(&pairs);
            let Some(m) = misfit(&some.iter().collect::<Vec<_>>()) else { continue };
            out.push(Candidate { notation, pairs, rms: m / (some.len() as f64).sqrt() });
        }
    }
    out
}

impl Notation {
    /// Conventions with this notation, completely (true) or except for the length unit (false).
    fn conventions(&self) -> (Vec<Convention>, bool) {
        let all = if self.reading.made.is_some() { Vec::new() } else { self.reading.conventions() };
        let whole: Vec<Convention> = all.iter().copied().filter(|c| Unit::of(*c) == self.unit).collect();
        if whole.is_empty() { (all, false) } else { (whole, true) }
    }

    /// Size of the change from the notation as read.
    fn changes(&self, as_read: &Notation) -> u32 {
        let (conventions, whole) = self.conventions();
        let orientation = match self.reading.orientation {
            _ if self.reading == as_read.reading => 0,
            _ if !conventions.is_empty() => 1,
            Orientation::Turns { factors: [a, _, b], .. } if a.axis != b.axis => 2,
            _ => 3,
        };
        let unit = if orientation == 0 { self.unit != as_read.unit } else { !whole };
        let made = u32::from(self.reading.made.is_some());
        orientation
            + made
            + u32::from(unit)
            + u32::from(self.transposed)
            + u32::from(self.inverted)
            + self.form.changes()
    }

    /// The changed parts of the notation: `as gba (R = Rx(A)·Ry(B)·Rz(C), degrees), with positions in metres`.
    fn words(&self, as_read: &Notation, convention: Convention) -> String {
        let (conventions, whole) = self.conventions();
        let mut parts = Vec::new();
        if self.reading != as_read.reading {
            let names: Vec<&str> = conventions.iter().map(|c| c.name()).collect();
            let meant = self.reading.words(convention);
            parts.push(if names.is_empty() {
                format!("as {meant}")
            } else {
                format!("as {} ({meant})", names.join(" or "))
            });
        }
        let unit = if self.reading == as_read.reading { self.unit != as_read.unit } else { !whole };
        if unit {
            parts.push(format!("with positions in {}", self.unit.name));
        }
        parts.extend(Some(self.form.words()).filter(|w| !w.is_empty()));
        if self.transposed {
            parts.push("with rotations transposed (column by column)".into());
        }
        if self.inverted {
            parts.push("when each is inverted: the mount is the other one (eye in hand, eye to hand)".into());
        }
        parts.join(", ")
    }

    fn next(&self, as_read: &Notation) -> String {
        let (conventions, whole) = self.conventions();
        let plain = !self.transposed && self.form == Form::PLAIN;
        if self.inverted && plain && self.reading == as_read.reading {
            return "state the mount as it is (mount in station.toml), or export the poses as base_from_flange".into();
        }
        match conventions.first().filter(|_| plain && whole && !self.inverted && self.reading != as_read.reading) {
            Some(c) => format!(
                "if the robot writes its poses so, name that convention in the pose file: '# convention: {}' and the \
                 columns frame,{}",
                c.name(),
                c.labels().join(",").replace(' ', "_")
            ),
            None => "compare with what the robot's program writes, and convert the poses into a convention of \
                 docs/conventions.md"
                .into(),
        }
    }
}

/// Another notation with which the pairs fit at least [`BETTER`] times better than as read.
pub fn explain(now: &Present<'_>, mount: Mount) -> Option<Explanation> {
    let numbers = Numbers::of(now, mount)?;
    let as_read = numbers.as_read();
    let mut all: Vec<Candidate> = turnings(&numbers).iter().flat_map(|t| candidates(&numbers, t)).collect();
    // A change of only the length unit is reported by the module `lengths`.
    all.retain(|c| Notation { unit: as_read.unit, ..c.notation } != as_read);
    let best = all.iter().map(|c| c.rms).fold(f64::INFINITY, f64::min);
    all.retain(|c| c.rms <= RIVAL * best);
    let rank = |c: &Candidate| c.notation.changes(&as_read);
    all.sort_by(|a, b| rank(a).cmp(&rank(b)).then(a.rms.total_cmp(&b.rms)));
    let mut distinct: Vec<Candidate> = Vec::new();
    for c in all {
        if !distinct.iter().any(|d| (d.rms / c.rms - 1.0).abs() < SAME) {
            distinct.push(c);
        }
    }
    let fitting =
        distinct.into_iter().take(MOST_POSES).filter_map(|c| Some((now.better(&c.pairs, BETTER)?, c.notation)));
    let found: Vec<(Fits, Notation)> = fitting.collect();
    let least = found.iter().map(|f| f.0.then).fold(f64::INFINITY, f64::min);
    let mut told = found.into_iter().filter(|f| f.0.then <= RIVAL * least);
    let (fits, notation) = told.next()?;
    let rivals: Vec<String> = told
        .map(|(f, n)| format!("; {} they would fit to {:.3} mm", n.words(&as_read, numbers.convention), f.then))
        .take(2)
        .collect();
    let convention = if numbers.of_file { format!("as {}", numbers.convention.name()) } else { "as they are".into() };
    Some(Explanation {
        what: format!(
            "the robot's poses, read {convention}, fit the pictures to {:.2} mm; in another notation they fit {:.0} \
             times better (limit {BETTER})",
            fits.now,
            fits.now / fits.then
        ),
        cause: format!(
            "{} the poses would fit to {:.3} mm{}",
            notation.words(&as_read, numbers.convention),
            fits.then,
            rivals.concat()
        ),
        next: notation.next(&as_read),
        fits,
        changes: notation.changes(&as_read).max(1),
        refuses: true,
        part: Vec::new(),
    })
}
