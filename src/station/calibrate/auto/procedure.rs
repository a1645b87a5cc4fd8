//! In: a cell, a board below its robot or on its flange, a target. Out: the rig, calibrated by moves that the
//! program chooses, and checked on poses that no solve used.
//! Frame and unit: mm, rad, px (docs/math.md, Joint calibration (9), (10)).

use super::super::joint::measure::{Finders, unjudged};
use super::super::joint::run::{FirstCamera, JointResult, calibrate_joint};
use super::cell::{Cell, Went};
use super::check::{SelfCheck, check};
use super::first;
use super::notebook::Notebook;
use super::options::AutoRun;
use super::result::{AutoResult, Ended};
use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::joint::choose::{Belief, Looks, candidates, next};
use crate::calibrate::joint::moved::moved;
use crate::calibrate::joint::options::{CameraPrior, JointOptions, Noise};
use crate::calibrate::joint::shots::{Part, Shot};
use crate::calibrate::joint::solve::{JointFit, solve};
use crate::calibrate::joint::start::{board, start};
use crate::calibrate::joint::terms::flange;
use crate::calibrate::joint::volume::places;
use crate::calibrate::measured_pose::intrinsic_covariance;
use crate::camera::ALWAYS_NAMED;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Board, Camera, Flange, Rigid};
use crate::recording::BoardSpec;
use crate::rig::Rig;

/// Number of stops for the check, which no solve uses.
const CHECKS: usize = 5;
/// How often poses for the check are drawn: some are refused, and from some the board is not found.
const CHECK_ROUNDS: usize = 3;
/// Fewest stops before the expected error is trusted: fewer determine the robot's scatter badly.
const FEWEST: usize = 14;
/// Number of wrong predictions in a row that ends the calibration with a fault.
const LOST: usize = 8;
/// Poses this near to one that the controller refused are not requested again: share of the board's distance, and
/// degrees.
const NEAR: (f64, f64) = (0.15, 12.0);
/// Number of refusals in a row after which the arm returns to its first pose, and after which the calibration
/// fails.
const BACK: usize = 3;
const STUCK: usize = 12;
/// Most poses that are tried until stripes determine the sheet.
const LIGHTS: usize = 10;
/// The calibration has stalled if this many stops have gained less than 2 %.
const STALLED: usize = 8;

/// The state between two stops.
struct Session<'a> {
    cell: &'a mut dyn Cell,
    run: &'a AutoRun,
    book: Notebook,
    first: FirstCamera,
    options: JointOptions,
    shots: Vec<Shot>,
    fit: JointFit,
    working: [f64; 2],
    /// Largest tilt that is requested, degrees: it grows while the predictions are right.
    tilt_deg: f64,
    tries: u64,
    /// Number of stops in a row at which the board was not found where it was predicted.
    lost: usize,
    /// Poses that the arm came by, the first pose first.
    trail: Vec<Rigid<Base, Flange>>,
    /// Poses to which the controller refused to go, and the number of refusals in a row.
    refused: Vec<Rigid<Base, Flange>>,
    stuck: usize,
}

/// Calibrates camera, hand-eye, laser plane and pointer automatically. `told` receives the number of stops and the
/// expected error after each stop.
///
/// # Errors
/// The board is not in the first picture, leaves the view with small moves, or moves; no model fits the
/// measurements; a move or a picture fails.
pub fn calibrate_auto(cell: &mut dyn Cell, rig: &Rig, run: &AutoRun, told: &dyn Fn(usize, f64)) -> Result<AutoResult> {
    run.check()?;
    let mut session = Session::begin(cell, rig, run)?;
    let (mut expected, mut known) = (Vec::new(), 0);
    let ended = loop {
        let belief = session.belief()?;
        if session.shots.len() > known {
            known = session.shots.len();
            expected.push(belief.expected_mm());
            told(known, belief.expected_mm());
        }
        if let Some(ended) = session.over(&expected) {
            break ended;
        }
        if !session.next_stop(&belief)? {
            break Ended::NoPose;
        }
    };
    let stops = session.shots.len();
    let joint = calibrate_joint(&session.book.recordings(), rig, &run.joint, &|_, _| {})?;
    let check = session.check(&joint)?;
    // The calibration remains valid if the arm does not return.
    let stranded = match session.home() {
        Ok(true) => None,
        Ok(false) => {
            Some("it cannot reach any of its earlier poses in a straight line; jog it back joint by joint".into())
        }
        Err(e) => Some(e.what),
    };
    let mut result = AutoResult { joint, expected_mm: expected, stops, ended, check };
    result.judge(run, stranded);
    Ok(result)
}

impl<'a> Session<'a> {
    /// Takes the picture at the present pose, makes the small moves, and solves once.
    fn begin(cell: &'a mut dyn Cell, rig: &Rig, run: &'a AutoRun) -> Result<Session<'a>> {
        let mut book = Notebook::new(&run.out, &run.board)?;
        let home = cell.pose()?;
        if let (None, why) = book.stop(cell, &home)? {
            return Err(Fault::input(format!("the board is not in the first picture: {why}"))
                .cause("it is out of view or cut off, badly lit, or another board than the one that was named")
                .next("jog the robot until the whole board is in the picture, and compare it with its description"));
        }
        first::moves(cell, &home, &mut book)?;
        let recordings = book.recordings();
        let size = [recordings[0].meta.image.width, recordings[0].meta.image.height];
        let first = first_camera(&book, run.joint.mount, size, rig)?;
        let options = JointOptions {
            mount: run.joint.mount,
            camera_free: first.free.clone(),
            camera_prior: first.prior.clone(),
            ..JointOptions::default()
        };
        let (shots, fit) = solved(&book, run, &first, &options)?;
        let depth = middle_depth(&fit.state.boards, &run.board);
        let working = run.working.unwrap_or([0.8 * depth, 1.2 * depth]);
        let mut session = Session {
            cell,
            run,
            book,
            first,
            options,
            shots,
            fit,
            working,
            tilt_deg: 14.0,
            tries: 0,
            lost: 0,
            trail: vec![home],
            refused: vec![],
            stuck: 0,
        };
        session.light()?;
        Ok(session)
    }

    /// Goes to poses within the working depths until stripes determine the sheet: from the first poses it may miss
    /// the board.
    fn light(&mut self) -> Result<()> {
        for _ in 0..LIGHTS {
            if self.fit.has(Part::Stripe) {
                break;
            }
            let all = self.candidates()?;
            let Some((_, to)) = all.first() else { break };
            match self.visit(to)? {
                Visit::Seen(_) => {
                    let first = FirstCamera { value: self.fit.state.camera, ..self.first.clone() };
                    (self.shots, self.fit) = solved(&self.book, self.run, &first, &self.options)?;
                }
                Visit::NotBegun(why) => self.elsewhere(*to, &why)?,
                Visit::Lost(_) => {}
            }
        }
        Ok(())
    }

    fn belief(&self) -> Result<Belief> {
        let known = self.fit.has(Part::Stripe);
        let belief = Belief::after(&self.fit, &places(&self.fit.state, self.working), &self.options);
        belief.filter(|_| known).ok_or_else(|| {
            Fault::refused("camera, hand-eye and laser plane are not determined by the stops so far")
                .cause("the stripe or the spot was not seen on the board")
                .next("check that line and pointer fall on the board, and begin again")
        })
    }

    fn over(&self, expected: &[f64]) -> Option<Ended> {
        let (n, now) = (self.shots.len(), *expected.last()?);
        if n >= FEWEST && now <= self.run.target_mm {
            return Some(Ended::Target);
        }
        if self.book.visits + CHECKS >= self.run.most || self.tries as usize > 3 * self.run.most {
            return Some(Ended::Most);
        }
        let before = expected.len().checked_sub(STALLED + 1).map(|i| expected[i]);
        (n >= FEWEST && self.tilt_deg >= LARGEST_TILT && before.is_some_and(|b| now > 0.98 * b))
            .then_some(Ended::Stalled)
    }

    /// Possible next views of the board, from allowed poses.
    fn candidates(&mut self) -> Result<Vec<(Rigid<Camera, Board>, Rigid<Base, Flange>)>> {
        self.tries += 1;
        let state = &self.fit.state;
        let length = self.working[1] - self.working[0];
        let looks = Looks {
            depths: [self.working[0] - 0.1 * length, self.working[1] + 0.1 * length],
            tilt_deg: self.tilt_deg,
            turn_deg: (4.0 * self.tilt_deg).min(180.0),
            margin_px: 0.02 * f64::from(state.camera.width),
            upright: upright(&state.boards),
            lit: self.fit.has(Part::Stripe),
        };
        let seed = self.run.seed.wrapping_mul(1_000_003).wrapping_add(self.tries);
        let mut out = Vec::new();
        for seen in candidates(state, &self.run.board, &looks, self.run.candidates, seed) {
            let to = flange(self.run.joint.mount, &state.near_from_camera, &state.far_from_board[0], &seen);
            if self.refused.iter().any(|r| alike(r, &to, self.working[1])) {
                continue;
            }
            if self.cell.may(&to)? {
                out.push((seen, to));
            }
        }
        Ok(out)
    }

    /// Goes to the best of the poses and adds its stop. False if there is no pose.
    fn next_stop(&mut self, belief: &Belief) -> Result<bool> {
        let all = self.candidates()?;
        let boards: Vec<Rigid<Camera, Board>> = all.iter().map(|c| c.0).collect();
        let Some(choice) = next(belief, &self.run.board, &boards, 0) else { return Ok(false) };
        let i = match self.visit(&all[choice.index].1)? {
            Visit::Seen(i) => i,
            Visit::NotBegun(why) => return self.elsewhere(all[choice.index].1, &why).map(|()| true),
            Visit::Lost(why) => {
                // The prediction was wrong: the next pose is chosen nearer to known ones.
                self.tilt_deg = (0.7 * self.tilt_deg).max(8.0);
                self.lost += 1;
                return if self.lost < LOST { Ok(true) } else { Err(lost(&why)) };
            }
        };
        (self.lost, self.stuck) = (0, 0);
        self.tilt_deg = (1.3 * self.tilt_deg).min(LARGEST_TILT);
        self.shots.push(self.measured(i)?);
        self.solve()?;
        Ok(true)
    }

    /// Goes to a pose and takes the pictures.
    fn visit(&mut self, to: &Rigid<Base, Flange>) -> Result<Visit> {
        let reported = match self.cell.go(to)? {
            Went::There(reported) => reported,
            Went::NotBegun(why) => return Ok(Visit::NotBegun(why)),
        };
        self.trail.push(*to);
        let (seen, why) = self.book.stop(self.cell, &reported)?;
        Ok(seen.map_or(Visit::Lost(why), Visit::Seen))
    }

    /// Handles a refusal by the controller: poses near `to` are not requested again, and after several refusals the
    /// arm returns to its first pose.
    fn elsewhere(&mut self, to: Rigid<Base, Flange>, why: &str) -> Result<()> {
        self.refused.push(to);
        self.stuck += 1;
        if self.stuck >= STUCK {
            return Err(Fault::refused(format!("the controller refused {STUCK} moves in a row: {why}"))
                .cause("straight motions from here pass through poses that the arm cannot reach")
                .next("jog the robot to where its wrist is bent, the board in view, and begin again"));
        }
        if self.stuck.is_multiple_of(BACK) { self.home().map(drop) } else { Ok(()) }
    }

    /// Returns to the first pose over the poses that the arm came by, so that the joints unwind as they were wound.
    /// A straight return could reach the same pose with a joint one turn off, from where the next motion may exceed
    /// the joint's range. If a step back is refused, because the arm stands slightly off the path, the straight
    /// return or an earlier pose is tried. False if none is reached: the procedure continues from the present pose.
    fn home(&mut self) -> Result<bool> {
        let began = self.trail[0];
        let mut there = true;
        while self.trail.len() > 1 {
            self.trail.pop();
            let before = *self.trail.last().expect("the beginning stays");
            there = matches!(self.cell.go(&before)?, Went::There(_));
            if !there
                && self.cell.may(&began)?
                && let Went::There(_) = self.cell.go(&began)?
            {
                self.trail.truncate(1);
                return Ok(true);
            }
        }
        Ok(there)
    }

    /// A stop's features; its stripe is distinguished from reflections with the sheet of some earlier stops.
    fn measured(&self, i: usize) -> Result<Shot> {
        let recordings = self.book.recordings();
        let with = FirstCamera { value: self.fit.state.camera, ..self.first.clone() };
        let finders: Finders<'_> = self.run.joint.finders(&recordings, &with);
        let step = (i / 4).max(1);
        let mut some: Vec<_> = (0..i).step_by(step).map(|k| &self.book.stops[k]).collect();
        some.push(&self.book.stops[i]);
        unjudged(&some, &finders).map(|mut shots| shots.pop().expect("one a stop"))
    }

    fn solve(&mut self) -> Result<()> {
        let mut state = self.fit.state.clone();
        state.boards =
            self.shots.iter().map(|s| Ok(board(&state.camera, &s.seen)?.camera_from_board)).collect::<Result<_>>()?;
        self.fit = solve(&with_beam(&self.shots), &state, self.fit.noise, &self.options)?;
        still(&self.shots, &self.fit, &self.options)?;
        let moved = self.fit.left_out.iter().filter(|l| l.part == Part::RobotPlace).count();
        if moved * 4 > self.shots.len() {
            return Err(Fault::input(format!(
                "the board moved: at {moved} of {} stops it is not where the others show it",
                self.shots.len()
            ))
            .cause("it was moved or slips, or the robot's poses are of another tool or work frame")
            .next("fix the board, check tool and work number of the controller (0), and begin again"));
        }
        Ok(())
    }

    /// Goes to poses that were not in the solve and checks the result there.
    fn check(&mut self, joint: &JointResult) -> Result<Option<SelfCheck>> {
        let before = self.book.stops.len();
        for _ in 0..CHECK_ROUNDS {
            for (_, to) in self.candidates()?.iter().take(2 * CHECKS) {
                if self.book.stops.len() == before + CHECKS || self.book.visits >= self.run.most {
                    break;
                }
                if let Visit::NotBegun(_) = self.visit(to)? {
                    self.refused.push(*to);
                }
            }
        }
        let shots: Vec<Shot> = (before..self.book.stops.len()).map(|i| self.measured(i)).collect::<Result<_>>()?;
        Ok(check(&joint.fit, self.run.joint.mount, &shots, joint.expected_mm()))
    }
}

/// The outcome of a visit to a pose.
enum Visit {
    /// The board was seen: the stop's number.
    Seen(usize),
    /// The board was not seen; the reason in words.
    Lost(String),
    /// The arm did not go; the reason in words.
    NotBegun(String),
}

/// Whether two flange poses count as near each other, `distance` from the board.
fn alike(a: &Rigid<Base, Flange>, b: &Rigid<Base, Flange>, distance: f64) -> bool {
    let (angle, mm) = a.difference(b);
    mm < NEAR.0 * distance && angle.to_degrees() < NEAR.1
}

fn lost(why: &str) -> Fault {
    Fault::input(format!("the board was not found at {LOST} poses in a row from which it should be visible: {why}"))
        .cause(
            "its squares or markers are too small at this distance, it is hidden or badly lit, or the poses are \
                not the flange's",
        )
        .next("take a board of larger squares or begin nearer to it; check tool and work number of the controller (0)")
}

/// Refuses stops between which the board was moved.
fn still(shots: &[Shot], fit: &JointFit, o: &JointOptions) -> Result<()> {
    match moved(shots, fit, o) {
        None => Ok(()),
        Some(m) => Err(Fault::input(format!("the board was moved by {:.1} mm before {}", m.mm, m.name))
            .cause("it was pushed, or it slipped")
            .next("fix it and begin again")),
    }
}

/// Largest tilt of the board against the picture that is requested, degrees.
const LARGEST_TILT: f64 = 45.0;

/// Orientation of the board in the first picture: turn about the optical axis, rad.
fn upright(boards: &[Rigid<Camera, Board>]) -> f64 {
    boards.first().map_or(0.0, |b| b.rotation[(1, 0)].atan2(b.rotation[(0, 0)]))
}

fn middle_depth(boards: &[Rigid<Camera, Board>], spec: &BoardSpec) -> f64 {
    let features = spec.features();
    let centre = features.iter().sum::<crate::geometry::Vec3>() / features.len() as f64;
    boards.iter().map(|b| b.point(&centre).z).sum::<f64>() / boards.len().max(1) as f64
}

/// Fewest spots that determine a beam: two would leave no redundancy.
const SPOTS: usize = 3;

/// The stops; their spots are removed if too few determine a beam, because otherwise nothing would be determined.
fn with_beam(shots: &[Shot]) -> Vec<Shot> {
    let mut out = shots.to_vec();
    if shots.iter().filter(|s| s.spot.is_some()).count() < SPOTS {
        out.iter_mut().for_each(|s| s.spot = None);
    }
    out
}

/// All stops so far, solved from scratch.
fn solved(
    book: &Notebook,
    run: &AutoRun,
    first: &FirstCamera,
    options: &JointOptions,
) -> Result<(Vec<Shot>, JointFit)> {
    let recordings = book.recordings();
    let mut shots = unjudged(&book.stops.iter().collect::<Vec<_>>(), &run.joint.finders(&recordings, first))?;
    let (state, _) = start(&mut shots, 1, &first.value, None, options)?;
    let fit = solve(&with_beam(&shots), &state, Noise::usual(), options)?;
    still(&shots, &fit, options)?;
    Ok((shots, fit))
}

/// The station's camera if it has one, else one from the small moves.
fn first_camera(book: &Notebook, mount: Mount, size: [u32; 2], rig: &Rig) -> Result<FirstCamera> {
    let known = rig.camera.as_ref().filter(|c| [c.value.width, c.value.height] == size);
    let (value, covariance) = match known {
        Some(c) => (c.value, intrinsic_covariance(&c.covariance)?),
        None => {
            let value = first::camera(&book.stops, mount, size)?;
            (value, first::usual(&value))
        }
    };
    let free: Vec<usize> =
        (0..ALWAYS_NAMED).chain(covariance.named().into_iter().filter(|i| *i >= ALWAYS_NAMED)).collect();
    let prior = Some(CameraPrior { mean: value.parameters(), covariance });
    Ok(FirstCamera { value, covariance, free, prior })
}
