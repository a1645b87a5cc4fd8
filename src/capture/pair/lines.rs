//! In: lines of text with positions: a head that names convention and clock, then a time and a pose or a count in
//! each line. Out: the content of each line; refused if units or order contradict the head.
//! Frame and unit: base_from_flange, mm, or counts; ns of the clock that the head names.

use crate::fault::{Fault, Result};
use crate::geometry::CountUnit;
use crate::recording::Stand;
use crate::robot::Convention;

/// The clock of the times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineClock {
    /// This machine's clock, since the Unix epoch.
    Unix,
    /// The sender's clock; converted by the earliest arrivals.
    Own,
}

/// Content of one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Time by [`Lines::clock`], ns.
    pub t_ns: u64,
    /// Position of what moves.
    pub stand: Stand,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Pose(Convention),
    Count,
}

/// From this number of lines on, their units are judged.
const JUDGED: usize = 5;
/// Over this time, ns, a second of the sender must last between half and twice as long here, whatever the network
/// does.
const LONG_ENOUGH: u64 = 200_000_000;
/// Poses that all lie within this distance of the base's origin, mm, are in metres.
const METRES: f64 = 8.0;
/// Longest line, bytes.
pub(super) const LONGEST: usize = 4096;

/// Reads the lines of one stream.
#[derive(Debug, Default)]
pub struct Lines {
    kind: Option<Kind>,
    clock: Option<LineClock>,
    /// The head states that unusual numbers are intended.
    meant: bool,
    first: Option<(u64, u64)>,
    seen: usize,
    reach: f64,
    largest_angle: f64,
    unit: Option<CountUnit>,
    /// The unit of lengths that the head states, if it names one.
    length: Option<String>,
}

fn head() -> &'static str {
    "begin the stream with '# convention: denso' (or another name) or '# counts: count', and '# clock: unix' or '# \
     clock: own'"
}

impl Lines {
    /// The clock of the times.
    pub fn clock(&self) -> LineClock {
        self.clock.unwrap_or(LineClock::Own)
    }

    /// Unit of an axis' counts.
    pub fn unit(&self) -> Option<CountUnit> {
        self.unit
    }

    /// Reads a line that arrived at `here_ns`; `None` for the head and for empty lines. `paced` means that lines
    /// arrive as they are written, not out of a file.
    ///
    /// # Errors
    /// Numbers before the head, a wrong number of values, a unit that contradicts the head.
    pub fn read(&mut self, line: &str, here_ns: u64, paced: bool) -> Result<Option<Told>> {
        let line = line.trim();
        if let Some(comment) = line.strip_prefix('#') {
            return self.head(comment.trim()).map(|()| None);
        }
        if line.is_empty() {
            return Ok(None);
        }
        let (Some(kind), Some(_)) = (self.kind, self.clock) else {
            return Err(Fault::input("poses arrived before the head that states their convention and clock")
                .cause("six numbers can be read in nine ways, and times by two clocks; this program does not guess")
                .next(head()));
        };
        self.length_is_that_of(kind)?;
        let bad = |why: &str| {
            Fault::input(format!(
                "'{}' is not a line of times and {}: {why}",
                shown(line),
                if kind == Kind::Count { "counts" } else { "poses" }
            ))
            .cause("another layout, or bytes that were lost")
            .next("write t_ns and the numbers, separated by blanks or commas")
        };
        let mut cells = line.split([' ', ',', '\t', ';']).filter(|c| !c.is_empty());
        let t_ns = cells
            .next()
            .and_then(|c| c.parse::<u64>().ok())
            .ok_or_else(|| bad("t_ns is a whole number of nanoseconds"))?;
        let numbers: Vec<f64> =
            cells.map(str::parse).collect::<std::result::Result<_, _>>().map_err(|_| bad("not numbers"))?;
        let stand = match kind {
            Kind::Pose(convention) => Stand::Robot(convention.read(&numbers)?),
            Kind::Count => match numbers[..] {
                [count] if count.abs() < 9e15 => Stand::Count(count),
                _ => return Err(bad("one count a line")),
            },
        };
        self.judge(kind, &numbers, &stand, t_ns, here_ns, paced)?;
        Ok(Some(Told { t_ns, stand }))
    }

    /// Refuses a stated unit of lengths that is not the convention's.
    fn length_is_that_of(&self, kind: Kind) -> Result<()> {
        let (Some(stated), Kind::Pose(convention)) = (&self.length, kind) else { return Ok(()) };
        // Matrices have no units in their labels; their lengths are in mm.
        let is = convention.labels()[0].split_once(' ').map_or("mm", |(_, unit)| unit);
        if stated == is {
            return Ok(());
        }
        Err(Fault::input(format!("the head states the unit '{stated}', {} has lengths in {is}", convention.name()))
            .cause("lengths in another unit, or units of lengths and angles in one line")
            .next(format!("send lengths in {is}, and state '# units: {is}' or nothing")))
    }

    fn head(&mut self, said: &str) -> Result<()> {
        let Some((key, value)) = said.split_once(':').map(|(k, v)| (k.trim(), v.trim())) else { return Ok(()) };
        let refuse = |what: String| Err(Fault::input(what).cause("a head of another program").next(head()));
        match key.to_lowercase().as_str() {
            "convention" => {
                let named = value.to_lowercase().parse::<Convention>();
                let kind = Kind::Pose(named.map_err(|e| Fault::input(e).next(head()))?);
                match self.kind.replace(kind) {
                    Some(Kind::Pose(other)) if Kind::Pose(other) != kind => {
                        return refuse(format!("the head names two conventions, '{}' and '{value}'", other.name()));
                    }
                    _ => {}
                }
            }
            "transform" if !["base_T_flange", "base_from_flange"].contains(&value) => {
                return refuse(format!("the head states the transform '{value}', only 'base_T_flange' is read"));
            }
            "counts" => {
                let known = [CountUnit::Count, CountUnit::Mm, CountUnit::Deg];
                let Some(unit) = known.into_iter().find(|u| u.name() == value) else {
                    return refuse(format!("counts are in '{value}': count, mm or deg"));
                };
                (self.kind, self.unit) = (Some(Kind::Count), Some(unit));
            }
            "clock" => {
                self.clock = Some(match value {
                    "unix" => LineClock::Unix,
                    "own" => LineClock::Own,
                    other => return refuse(format!("the clock is '{other}': unix or own")),
                });
            }
            "unit" | "units" if value == "as named" => self.meant = true,
            "unit" | "units" => self.length = Some(value.to_lowercase()),
            _ => {}
        }
        Ok(())
    }

    /// Checks units by the plausibility of the values.
    fn judge(
        &mut self,
        kind: Kind,
        numbers: &[f64],
        stand: &Stand,
        t_ns: u64,
        here_ns: u64,
        paced: bool,
    ) -> Result<()> {
        self.seen += 1;
        self.clocks(t_ns, here_ns, paced)?;
        self.units(kind, numbers, stand)
    }

    /// Checks that times advance at the rate of real time, and belong to the clock that the head names.
    fn clocks(&mut self, t_ns: u64, here_ns: u64, paced: bool) -> Result<()> {
        let (t0, here0) = *self.first.get_or_insert((t_ns, here_ns));
        let (there, here) = (t_ns.saturating_sub(t0) as f64, here_ns.saturating_sub(here0));
        let long = paced && here >= LONG_ENOUGH && t_ns > t0;
        if long && self.seen > JUDGED && !(0.5..=2.0).contains(&(there / here as f64)) {
            let per = 1e9 * there / here as f64;
            let unit = [(1e3, "milliseconds"), (1e6, "microseconds"), (1.0, "seconds")];
            let near =
                unit.iter().find(|(n, _)| (0.5..=2.0).contains(&(per / n))).map_or("another unit", |(_, name)| name);
            return Err(Fault::refused(format!("t_ns increases by {per:.0} in a second, expected are 1000000000"))
                .cause(format!("the times are in {near}, or the sender runs at another speed than time"))
                .next("send true times in nanoseconds"));
        }
        if self.clock == Some(LineClock::Unix) && paced && here_ns.abs_diff(t_ns) > 3_600_000_000_000 && !self.meant {
            return Err(Fault::refused(format!(
                "a pose is {:.0} s from this machine's time, and the head says '# clock: unix'",
                here_ns.abs_diff(t_ns) as f64 * 1e-9
            ))
            .cause("the sender's clock is another one, or its times are not in nanoseconds")
            .next("write '# clock: own', or synchronise the clocks"));
        }
        Ok(())
    }

    /// Checks that positions and angles are plausible in the convention's units.
    fn units(&mut self, kind: Kind, numbers: &[f64], stand: &Stand) -> Result<()> {
        let (Kind::Pose(convention), Stand::Robot(pose), false) = (kind, stand, self.meant) else { return Ok(()) };
        self.reach = self.reach.max(pose.translation.norm());
        let angles = convention.angles();
        if let Some((place, _)) = &angles {
            self.largest_angle = numbers[place.clone()].iter().fold(self.largest_angle, |m, a| m.max(a.abs()));
        }
        if self.seen < JUDGED {
            return Ok(());
        }
        let asked = |what: String, cause: &str| {
            Err(Fault::refused(what).cause(cause.to_owned()).next(
                "name the convention that the robot really writes, \
                or confirm the unit with '# units: as named' in the head",
            ))
        };
        let name = convention.name();
        if self.reach < METRES {
            return asked(
                format!("all poses lie within {:.3} mm of the base's origin", self.reach),
                "positions in metres under a convention in millimetres",
            );
        }
        match angles {
            Some((_, true)) if self.largest_angle > 0.0 && self.largest_angle < 7.0 => {
                asked(format!("no angle is above {:.3}, {name} has degrees", self.largest_angle), "angles in radians")
            }
            Some((_, false)) if self.largest_angle > 6.3 => {
                asked(format!("an angle is {:.3}, {name} has radians", self.largest_angle), "angles in degrees")
            }
            _ => Ok(()),
        }
    }
}

fn shown(line: &str) -> String {
    line.chars().take(60).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(lines: &str) -> std::result::Result<usize, String> {
        let mut reader = Lines::default();
        let mut told = 0;
        for (k, line) in lines.lines().enumerate() {
            let here = 1_700_000_000_000_000_000 + k as u64 * 50_000_000;
            told += usize::from(reader.read(line, here, true).map_err(|e| e.to_string())?.is_some());
        }
        Ok(told)
    }

    fn stream(head: &str, per_line: u64, pose: &str) -> String {
        let rows: Vec<String> = (0..12u64).map(|k| format!("{} {pose}", 5000 + k * per_line)).collect();
        format!("{head}\n{}", rows.join("\n"))
    }

    #[test]
    fn lines_say_what_was_named_or_are_refused() {
        let denso = "# convention: denso\n# clock: own";
        let pose = "400 0 300 180 0 90";
        assert_eq!(all(&stream(denso, 50_000_000, pose)), Ok(12));
        assert_eq!(all(&stream("# counts: count\n# clock: own", 50_000_000, "17")), Ok(12));
        let more = "# Convention: DENSO\n# convention: denso\n# transform: base_T_flange\n# unit: mm\n# Clock: own";
        assert_eq!(all(&stream(more, 50_000_000, pose)), Ok(12));
        for (head, per_line, pose, says) in [
            ("# clock: own", 50_000_000, pose, "their convention and clock"),
            ("# convention: denso", 50_000_000, pose, "their convention and clock"),
            ("# convention: yamaha\n# clock: own", 1, pose, "unknown pose convention"),
            (denso, 50, pose, "milliseconds"),
            (denso, 50_000, pose, "microseconds"),
            (denso, 50_000_000, "0.4 0 0.3 180 0 90", "metres"),
            (denso, 50_000_000, "400 0 300 3.14 0 1.5", "radians"),
            ("# convention: ur\n# clock: own", 50_000_000, "0.4 0 0.3 40 0 20", "degrees"),
            (denso, 50_000_000, "400 0 300 180 0", "6 numbers"),
            (denso, 50_000_000, "400 0 300 180 0 x", "not numbers"),
            ("# convention: denso\n# clock: unix", 50_000_000, pose, "clock: own"),
            ("# counts: inch\n# clock: own", 1, "5", "count, mm or deg"),
            ("# convention: denso\n# convention: gba\n# clock: own", 1, pose, "two conventions, 'denso' and 'gba'"),
            ("# convention: denso\n# Transform: flange_T_base\n# clock: own", 1, pose, "'flange_T_base'"),
            ("# units: m\n# convention: denso\n# clock: own", 1, pose, "the unit 'm', denso has lengths in mm"),
        ] {
            let said = all(&stream(head, per_line, pose)).unwrap_err();
            assert!(said.contains(says) && said.contains("next step"), "{says}: {said}");
        }
        let meant = format!("# units: as named\n{denso}");
        assert_eq!(all(&stream(&meant, 50_000_000, "400 0 300 3 0 1")), Ok(12));
    }
}
