//! In: the numbers of a camera's pictures as they came over the wire. Out: numbers that go on where 16 bits end;
//! whether the count began anew.
//! Frame and unit: pictures.

/// Numbers of 16 bits go from 65535 on to 1: GigE Vision leaves 0 out. A camera that was seen to use 0 goes on to 0.
const CYCLE: u64 = 65_535;
/// Nothing is overtaken by more: a number farther back is of a count that began anew.
const FARTHEST: u64 = 16;

/// Numbers that go on where those on the wire begin anew after 16 bits.
#[derive(Default)]
pub(super) struct Numbers {
    newest: Option<u64>,
    /// What is added to a number on the wire.
    base: u64,
    /// 0 is one of its numbers.
    zero: bool,
}

impl Numbers {
    /// The number of a picture; `None` where the camera's count began anew: it was reset.
    pub fn on_from(&mut self, raw: u64) -> Option<u64> {
        self.zero |= raw == 0;
        let Some(newest) = self.newest else {
            self.newest = Some(raw);
            return Some(raw);
        };
        // Wider numbers than 16 bits go on by themselves.
        let wide = self.base == 0 && newest.max(raw) > CYCLE;
        let cycle = CYCLE + u64::from(self.zero);
        let near = |id: &u64| id.saturating_add(FARTHEST) > newest && (wide || *id < newest.saturating_add(CYCLE / 2));
        let bases = [Some(self.base), self.base.checked_add(cycle), self.base.checked_sub(cycle)];
        let ids = bases.into_iter().take(if wide { 1 } else { 3 }).flatten().filter_map(|base| raw.checked_add(base));
        let found = ids.into_iter().find(near)?;
        if found > newest {
            (self.newest, self.base) = (Some(found), found - raw);
        }
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_on_after_sixteen_bits_and_a_reset_is_seen() {
        let all = |raw: &[u64]| {
            let mut numbers = Numbers::default();
            raw.iter().map(|r| numbers.on_from(*r)).collect::<Vec<_>>()
        };
        assert_eq!(all(&[65_534, 65_535, 1, 65_533, 2, 5]), [65_534, 65_535, 65_536, 65_533, 65_537, 65_540].map(Some));
        // Three times round, a picture in twenty thousand.
        let mut numbers = Numbers::default();
        for id in (1..4 * CYCLE).step_by(20_000) {
            assert_eq!(numbers.on_from((id - 1) % CYCLE + 1), Some(id));
        }
        // 64 bits: nothing to go round.
        assert_eq!(all(&[65_535, 65_536, 200_000, 199_999]), [65_535, 65_536, 200_000, 199_999].map(Some));
        assert_eq!(all(&[5000, 1]), [Some(5000), None]);
        // A camera that does not leave 0 out.
        assert_eq!(all(&[65_535, 0, 1, 65_535, 2]), [65_535, 65_536, 65_537, 65_535, 65_538].map(Some));
        // What no camera sends, but the wire may.
        assert_eq!(all(&[u64::MAX - 1, u64::MAX, 0]), [Some(u64::MAX - 1), Some(u64::MAX), None]);
        assert_eq!(all(&[1, u64::MAX]), [1, u64::MAX].map(Some));
        assert_eq!(all(&[3, 1, 4]), [3, 1, 4].map(Some));
    }
}
