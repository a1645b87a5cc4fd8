//! In: what the device and the twin made of a case. Out: the word in which they are furthest apart.

use crate::case::Case;
use crate::device::Adapter;
use crate::stage::{Access, Binding, Stage};
use crate::words::Words;

/// The word of a case in which device and twin are furthest apart, measured in the tolerance's own limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// Where: binding, element, field.
    pub place: String,
    /// What the device wrote.
    pub device: String,
    /// What the twin wrote.
    pub twin: String,
    /// How far apart they are.
    pub distance: f64,
    /// How far apart they may be.
    pub limit: f64,
    /// The unit of both.
    pub unit: &'static str,
    /// Words of the case that are beyond their limit; 1 where the stage's own rule refuses the case.
    pub words_beyond: usize,
}

/// What one case gave.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseResult {
    /// Name of the case.
    pub name: String,
    /// Words that were compared.
    pub words: usize,
    /// `None` where every word is the same.
    pub worst: Option<Worst>,
}

impl CaseResult {
    /// No word is beyond its limit.
    pub fn passed(&self) -> bool {
        self.worst.as_ref().is_none_or(|w| w.words_beyond == 0)
    }

    /// One line: what was compared, and the worst word.
    pub fn line(&self) -> String {
        match &self.worst {
            None => format!("{} words, all the same", self.words),
            Some(w) => format!(
                "{} words, {} beyond the limit; worst at {}: device {}, twin {}, distance {} of {} ({})",
                self.words, w.words_beyond, w.place, w.device, w.twin, w.distance, w.limit, w.unit
            ),
        }
    }
}

/// What the comparison of a stage gave.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The adapter that computed one of the two sides.
    pub adapter: Adapter,
    /// Each case.
    pub cases: Vec<CaseResult>,
}

impl Comparison {
    /// There are cases, and each passed.
    pub fn passed(&self) -> bool {
        !self.cases.is_empty() && self.cases.iter().all(CaseResult::passed)
    }
}

/// The distance of what the device and what the twin made of a case: the device's content of all bindings comes first.
pub(crate) type Apart = dyn Fn(&Case, &[Words], &[Words]) -> f64;

/// A caller's own rule for a stage.
pub(crate) struct Rule {
    pub apart: Box<Apart>,
    pub limit: f64,
}

/// Compares a case by the stage's own rule, or else the words of all writable bindings by their tolerances.
pub(crate) fn compared(
    stage: &Stage,
    rule: Option<&Rule>,
    case: &Case,
    device: &[Words],
    twin: &[Words],
) -> CaseResult {
    match rule {
        None => word_by_word(stage, &case.name, device, twin),
        Some(rule) => by_rule(stage, rule, case, device, twin),
    }
}

fn by_rule(stage: &Stage, rule: &Rule, case: &Case, device: &[Words], twin: &[Words]) -> CaseResult {
    let (distance, limit) = ((rule.apart)(case, device, twin), rule.limit);
    let written = stage.bindings.iter().zip(twin).filter(|(b, _)| b.access == Access::ReadWrite);
    let words = written.map(|(_, words)| words.raw().len()).sum();
    // Not a number is beyond every limit.
    let within = distance <= limit;
    let worst = (distance != 0.0).then(|| Worst {
        place: "the stage's own rule".into(),
        device: "all bindings".into(),
        twin: "all bindings".into(),
        distance,
        limit,
        unit: "the rule's own",
        words_beyond: usize::from(!within),
    });
    CaseResult { name: case.name.clone(), words, worst }
}

fn word_by_word(stage: &Stage, name: &str, device: &[Words], twin: &[Words]) -> CaseResult {
    let mut result = CaseResult { name: name.into(), words: 0, worst: None };
    // Distance over limit, which makes rules of different units comparable.
    let (mut worst_share, mut beyond) = (0.0, 0);
    for ((binding, device), twin) in stage.bindings.iter().zip(device).zip(twin) {
        if binding.access != Access::ReadWrite {
            continue;
        }
        for (i, (&a, &b)) in device.raw().iter().zip(twin.raw()).enumerate() {
            let (element, byte, layout) = binding.shape.element_at(4 * i);
            let field = layout.field_at(byte);
            if field.is_none() && !layout.fields.is_empty() {
                continue;
            }
            result.words += 1;
            // Equal bits are at distance 0 under every rule.
            if a == b {
                continue;
            }
            let tolerance = tolerance_of(binding, field.map(|f| f.name));
            let (distance, limit) = (tolerance.distance(a, b), tolerance.limit());
            beyond += usize::from(distance > limit);
            let share = if distance > 0.0 && limit == 0.0 { f64::INFINITY } else { distance / limit };
            if share > worst_share {
                worst_share = share;
                let element = element.map_or(String::new(), |e| format!("[{e}]"));
                let word = byte - field.map_or(0, |f| f.offset);
                let part = match field {
                    Some(f) if f.bytes > 4 => format!(".{}, byte {word}", f.name),
                    Some(f) => format!(".{}", f.name),
                    None if layout.bytes > 4 => format!(", byte {word}"),
                    None => String::new(),
                };
                result.worst = Some(Worst {
                    place: format!("{}{element}{part}", binding.name),
                    device: tolerance.show(a),
                    twin: tolerance.show(b),
                    distance,
                    limit,
                    unit: tolerance.unit(),
                    words_beyond: 0,
                });
            }
        }
    }
    if let Some(worst) = &mut result.worst {
        worst.words_beyond = beyond;
    }
    result
}

fn tolerance_of<'a>(binding: &'a Binding, field: Option<&str>) -> &'a crate::Tolerance {
    let own = binding.fields.iter().find(|(name, _)| Some(name.as_str()) == field);
    own.map(|(_, t)| t).or(binding.tolerance.as_ref()).expect("a writable binding has a tolerance: Binding::read_write")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Shape, Tolerance, layout};

    #[repr(C)]
    #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
    struct Found {
        index: u32,
        level: f32,
        padding: u32,
    }

    fn stage() -> Stage {
        let shape = Shape::Array(layout!(Found { index, level }));
        let found = Binding::read_write("found", shape, Tolerance::exact("indices"))
            .field("level", Tolerance::absolute(0.5, "rounded"));
        Stage::new("s", "", "main", [1; 3], vec![Binding::read("given", Shape::array::<u32>()), found])
    }

    fn result(index: u32, level: f32, padding: u32) -> CaseResult {
        let device = [Found { index: 0, level: 0.0, padding: 0 }, Found { index, level, padding }];
        let twin = [Found { index: 0, level: 0.0, padding: 0 }, Found { index: 7, level: 1.0, padding: 0 }];
        word_by_word(&stage(), "case", &[Words::zeros(1), Words::of(&device)], &[Words::zeros(1), Words::of(&twin)])
    }

    #[test]
    fn each_field_has_its_own_tolerance_and_padding_has_no_meaning() {
        assert_eq!(result(7, 1.0, 9), CaseResult { name: "case".into(), words: 4, worst: None });
        let within = result(7, 1.25, 0);
        assert!(within.passed());
        let worst = within.worst.unwrap();
        assert_eq!((worst.place.as_str(), worst.distance, worst.limit), ("found[1].level", 0.25, 0.5));
        assert!(!result(7, 1.75, 0).passed());
    }

    #[test]
    fn an_exact_word_that_differs_is_worse_than_any_number() {
        let both = result(8, 9.0, 0);
        assert!(!both.passed());
        let worst = both.worst.as_ref().unwrap();
        assert_eq!((worst.place.as_str(), worst.words_beyond), ("found[1].index", 2));
        assert!(both.line().contains("device 0x00000008 (8"), "{}", both.line());
    }

    #[test]
    fn a_rule_of_the_caller_replaces_the_tolerances() {
        let (case, stage) = (Case::new("c", [1; 3]), stage());
        let judge = |distance: f64| {
            let apart = Box::new(move |_: &Case, a: &[Words], b: &[Words]| if a == b { distance } else { -9.0 });
            let words = [Words::zeros(1), Words::zeros(6)];
            compared(&stage, Some(&Rule { apart, limit: 2.0 }), &case, &words, &words)
        };
        assert_eq!((judge(0.0).worst, judge(0.0).words), (None, 6));
        assert!(judge(2.0).passed() && !judge(2.5).passed() && !judge(f64::NAN).passed());
        assert_eq!(judge(2.5).worst.unwrap().limit, 2.0);
    }

    #[test]
    fn a_comparison_of_no_case_has_not_passed() {
        let adapter = Adapter::for_tests();
        assert!(!Comparison { adapter, cases: Vec::new() }.passed());
    }
}
