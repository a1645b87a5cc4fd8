//! In: how far two results may be apart, and why. Out: the distance of two words, in the rule's unit.

/// How far the device may be from the twin, with the reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    rule: Rule,
    limit: f64,
    reason: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    Exact,
    Absolute,
    Relative,
    Ulps,
}

impl Tolerance {
    fn new(rule: Rule, limit: f64, reason: &str) -> Tolerance {
        Tolerance { rule, limit, reason: reason.into() }
    }

    /// Every bit is the same.
    pub fn exact(reason: &str) -> Tolerance {
        Tolerance::new(Rule::Exact, 0.0, reason)
    }

    /// Words are `f32`; their difference is at most `limit`, in the values' own unit.
    pub fn absolute(limit: f64, reason: &str) -> Tolerance {
        Tolerance::new(Rule::Absolute, limit, reason)
    }

    /// Words are `f32`; their difference divided by the larger magnitude of the two is at most `limit`.
    pub fn relative(limit: f64, reason: &str) -> Tolerance {
        Tolerance::new(Rule::Relative, limit, reason)
    }

    /// Words are `f32`; at most this many steps from one `f32` to the next lie between them.
    pub fn ulps(limit: u32, reason: &str) -> Tolerance {
        Tolerance::new(Rule::Ulps, f64::from(limit), reason)
    }

    /// Why results within the limit count as the same.
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// Largest distance allowed; 0 where every bit counts.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// The unit of limit and distance.
    pub fn unit(&self) -> &'static str {
        match self.rule {
            Rule::Exact => "exact bits",
            Rule::Absolute => "absolute",
            Rule::Relative => "relative",
            Rule::Ulps => "ULPs",
        }
    }

    /// What makes it useless, if something does.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.reason.trim().is_empty() {
            return Some(format!("a tolerance ({}, limit {}) has no reason", self.unit(), self.limit));
        }
        let usable = self.limit.is_finite() && self.limit >= 0.0;
        (!usable).then(|| format!("a tolerance has the limit {}, a finite number from 0 on is needed", self.limit))
    }

    /// Distance of two words. Two values that are not a number are the same under every rule but `exact`.
    pub(crate) fn distance(&self, device: u32, twin: u32) -> f64 {
        let (a, b) = (f32::from_bits(device), f32::from_bits(twin));
        if device == twin {
            return 0.0;
        }
        if self.rule == Rule::Exact {
            return 1.0;
        }
        if a.is_nan() || b.is_nan() {
            return if a.is_nan() && b.is_nan() { 0.0 } else { f64::INFINITY };
        }
        if a.is_infinite() || b.is_infinite() {
            return f64::INFINITY;
        }
        let difference = (f64::from(a) - f64::from(b)).abs();
        match self.rule {
            Rule::Exact => unreachable!("answered above"),
            Rule::Absolute => difference,
            // Zero against minus zero is no difference.
            Rule::Relative if difference == 0.0 => 0.0,
            Rule::Relative => difference / f64::from(a.abs().max(b.abs())),
            Rule::Ulps => (ordered(a) - ordered(b)).abs() as f64,
        }
    }

    /// A word as a person reads it.
    pub(crate) fn show(&self, word: u32) -> String {
        match self.rule {
            Rule::Exact => format!("{word:#010x} ({word}, as f32 {:?})", f32::from_bits(word)),
            _ => format!("{:?}", f32::from_bits(word)),
        }
    }
}

/// Number of steps from zero.
fn ordered(value: f32) -> i64 {
    let magnitude = i64::from(value.to_bits() & 0x7fff_ffff);
    if value.is_sign_negative() { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apart(tolerance: &Tolerance, a: f32, b: f32) -> f64 {
        tolerance.distance(a.to_bits(), b.to_bits())
    }

    #[test]
    fn every_rule_measures_in_its_own_unit() {
        let next = f32::from_bits(1.0f32.to_bits() + 3);
        assert_eq!(apart(&Tolerance::ulps(3, "r"), 1.0, next), 3.0);
        assert_eq!(apart(&Tolerance::absolute(1.0, "r"), 2.0, -1.5), 3.5);
        assert_eq!(apart(&Tolerance::relative(1.0, "r"), 4.0, -4.0), 2.0);
        assert_eq!(apart(&Tolerance::exact("r"), 0.0, -0.0), 1.0);
        // Zero lies between the smallest numbers of both signs.
        let least = f32::from_bits(1);
        assert_eq!(apart(&Tolerance::ulps(2, "r"), least, -least), 2.0);
    }

    #[test]
    fn zeros_and_not_a_number_are_what_they_should_be() {
        for t in [Tolerance::absolute(0.0, "r"), Tolerance::relative(0.0, "r"), Tolerance::ulps(0, "r")] {
            assert_eq!(apart(&t, 0.0, -0.0), 0.0, "{t:?}");
            assert_eq!(apart(&t, f32::NAN, -f32::NAN), 0.0, "{t:?}");
            assert_eq!(apart(&t, f32::NAN, 1.0), f64::INFINITY, "{t:?}");
            assert_eq!(apart(&t, f32::INFINITY, f32::MAX), f64::INFINITY, "{t:?}");
            assert_eq!(apart(&t, f32::INFINITY, f32::INFINITY), 0.0, "{t:?}");
        }
    }

    #[test]
    fn a_tolerance_needs_a_reason_and_a_usable_limit() {
        assert!(Tolerance::exact(" ").fault().unwrap().contains("no reason"));
        assert!(Tolerance::absolute(f64::NAN, "r").fault().unwrap().contains("NaN"));
        assert!(Tolerance::absolute(-1.0, "r").fault().is_some());
        assert_eq!(Tolerance::ulps(1, "r").fault(), None);
    }
}
