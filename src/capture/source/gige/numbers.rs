//! In: the numbers of a camera's pictures as transmitted. Out: numbers that continue beyond 16 bits, and whether the
//! count restarted.
//! Frame and unit: pictures.

/// Numbers of 16 bits wrap from 65535 to 1: GigE Vision skips 0. A camera that was seen to use 0 wraps to 0.
const CYCLE: u64 = 65_535;
/// Pictures arrive at most this many numbers late: a number farther back belongs to a count that restarted.
const FARTHEST: u64 = 16;

/// Numbers that continue when the transmitted ones wrap around after 16 bits.
#[derive(Default)]
pub(super) struct Numbers {
    newest: Option<u64>,
    /// Offset added to a transmitted number.
    base: u64,
    /// Whether 0 is one of its numbers.
    zero: bool,
}

impl Numbers {
    /// The number of a picture; `None` if the camera's count restarted, because it was reset.
    pub fn on_from(&mut self, raw: u64) -> Option<u64> {
        self.zero |= raw == 0;
        let Some(newest) = self.newest else {
            self.newest = Some(raw);
            return Some(raw);
        };
        // Numbers wider than 16 bits do not wrap.
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
        // Three wraps, with one picture in twenty thousand.
        let mut numbers = Numbers::default();
        for id in (1..4 * CYCLE).step_by(20_000) {
            assert_eq!(numbers.on_from((id - 1) % CYCLE + 1), Some(id));
        }
        // 64 bits: no wrap.
        assert_eq!(all(&[65_535, 65_536, 200_000, 199_999]), [65_535, 65_536, 200_000, 199_999].map(Some));
        assert_eq!(all(&[5000, 1]), [Some(5000), None]);
        // A camera that does not skip 0.
        assert_eq!(all(&[65_535, 0, 1, 65_535, 2]), [65_535, 65_536, 65_537, 65_535, 65_538].map(Some));
        // Numbers that no camera sends but that may be received.
        assert_eq!(all(&[u64::MAX - 1, u64::MAX, 0]), [Some(u64::MAX - 1), Some(u64::MAX), None]);
        assert_eq!(all(&[1, u64::MAX]), [1, u64::MAX].map(Some));
        assert_eq!(all(&[3, 1, 4]), [3, 1, 4].map(Some));
    }
}
