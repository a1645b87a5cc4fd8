//! In: the closed outlines of one height. Out: a level surface, and a fast test of whether a place lies on it.
//! Frame and unit: the part's frame; mm.

use super::outline::crosses;

/// A level surface: union of the high shapes less the low ones at one height.
#[derive(Clone, Debug)]
pub struct Face {
    /// Height along the part's z, mm.
    pub z: f64,
    high: Outlines,
    low: Outlines,
}

impl Face {
    pub(in crate::find) fn new(z: f64, high: Vec<Vec<[f64; 2]>>, low: Vec<Vec<[f64; 2]>>) -> Face {
        Face { z, high: Outlines::new(high), low: Outlines::new(low) }
    }

    /// True where the surface exists.
    pub fn material(&self, x: f64, y: f64) -> bool {
        self.high.hold(x, y) && !self.low.hold(x, y)
    }
}

/// A range in equal parts, and the part in which a value lies. The part's number never falls as the value rises,
/// whatever is rounded.
#[derive(Clone, Copy, Debug)]
struct Parts {
    low: f64,
    high: f64,
    count: usize,
}

impl Parts {
    fn of(values: impl Iterator<Item = f64>, count: usize) -> Parts {
        let (low, high) = values.fold((f64::MAX, f64::MIN), |m, v| (m.0.min(v), m.1.max(v)));
        Parts { low, high, count }
    }
    fn hold(&self, v: f64) -> bool {
        (self.low..=self.high).contains(&v)
    }
    fn at(&self, v: f64) -> usize {
        let share = (v - self.low) / (self.high - self.low).max(f64::MIN_POSITIVE);
        ((share * self.count as f64) as usize).min(self.count - 1)
    }
}

/// Lists, stored one after another.
#[derive(Clone, Debug, Default)]
struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// `each` gives (list, item) pairs, and must give the same ones each time it is called.
    fn new(lists: usize, each: impl Fn(&mut dyn FnMut(usize, usize))) -> Lists {
        let mut starts = vec![0; lists + 1];
        each(&mut |list, _| starts[list + 1] += 1);
        for i in 0..lists {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[lists] as usize];
        each(&mut |list, item| {
            items[next[list] as usize] = item as u32;
            next[list] += 1;
        });
        Lists { starts, items }
    }
    fn of(&self, list: usize) -> &[u32] {
        &self.items[self.starts[list] as usize..self.starts[list + 1] as usize]
    }
}

/// Closed outlines, each listed in the grid cells that its box overlaps.
#[derive(Clone, Debug)]
struct Outlines {
    loops: Vec<Outline>,
    x: Parts,
    y: Parts,
    cells: Lists,
}

/// Most cells along one side of the grid: bounds the memory where large outlines lie in many cells.
const MOST_CELLS: usize = 32;

impl Outlines {
    fn new(loops: Vec<Vec<[f64; 2]>>) -> Outlines {
        let loops: Vec<Outline> = loops.into_iter().map(Outline::new).collect();
        let side = ((loops.len() as f64).sqrt().ceil() as usize).clamp(1, MOST_CELLS);
        let x = Parts::of(loops.iter().flat_map(|l| [l.x.low, l.x.high]), side);
        let y = Parts::of(loops.iter().flat_map(|l| [l.y.low, l.y.high]), side);
        let cells = Lists::new(side * side, |put| {
            for (i, l) in loops.iter().enumerate() {
                for row in y.at(l.y.low)..=y.at(l.y.high) {
                    (x.at(l.x.low)..=x.at(l.x.high)).for_each(|column| put(row * side + column, i));
                }
            }
        });
        Outlines { loops, x, y, cells }
    }

    fn hold(&self, x: f64, y: f64) -> bool {
        let inside = self.x.hold(x) && self.y.hold(y);
        inside
            && self
                .cells
                .of(self.y.at(y) * self.x.count + self.x.at(x))
                .iter()
                .any(|&i| self.loops[i as usize].holds(x, y))
    }
}

/// One closed outline, its sides listed by rows.
#[derive(Clone, Debug)]
struct Outline {
    points: Vec<[f64; 2]>,
    x: Parts,
    y: Parts,
    rows: Lists,
}

/// Number of sides in a row, about, and most rows.
const SIDES: usize = 8;
const MOST_ROWS: usize = 512;

impl Outline {
    fn new(points: Vec<[f64; 2]>) -> Outline {
        let n = points.len();
        let x = Parts::of(points.iter().map(|p| p[0]), 1);
        let mut y = Parts::of(points.iter().map(|p| p[1]), (n / SIDES).clamp(1, MOST_ROWS));
        let span = |y: &Parts, i: usize| {
            let (a, b) = (y.at(points[i][1]), y.at(points[(i + 1) % n][1]));
            a.min(b)..=a.max(b)
        };
        // Where sides run through many rows, as those of a comb do, there are fewer rows.
        while y.count > 1 && (0..n).map(|i| span(&y, i).count()).sum::<usize>() > SIDES * n {
            y.count /= 2;
        }
        let rows = Lists::new(y.count, |put| (0..n).for_each(|i| span(&y, i).for_each(|row| put(row, i))));
        Outline { points, x, y, rows }
    }

    /// Whether a place lies inside, by the even-odd rule.
    fn holds(&self, x: f64, y: f64) -> bool {
        if !(self.x.hold(x) && self.y.hold(y)) {
            return false;
        }
        let side = |i: &&u32| {
            let i = **i as usize;
            crosses(self.points[i], self.points[(i + 1) % self.points.len()], x, y)
        };
        self.rows.of(self.y.at(y)).iter().filter(side).count() % 2 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::model::outline::contains;
    use rand::{Rng, SeedableRng};

    /// Outlines of many kinds: few and many corners, combs, outlines without height, large numbers of them.
    #[test]
    fn the_index_says_what_the_plain_rule_says() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        for case in 0..40 {
            let count = [1, 3, 40, 300][case % 4];
            let loops: Vec<Vec<[f64; 2]>> = (0..count)
                .map(|_| {
                    let n = [3, 4, 100, 700][rng.random_range(0..4)];
                    let (cx, cy, r) =
                        (rng.random_range(-50.0..50.0), rng.random_range(-9.0..9.0), 10.0 / count as f64 + 1.0);
                    (0..n)
                        .map(|i| {
                            let (s, c) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                            let comb = if case % 5 == 0 && i % 2 == 0 { 0.2 } else { 1.0 };
                            let flat = if case % 7 == 0 { 0.0 } else { 1.0 };
                            [cx + r * c * comb, cy + flat * r * s * comb]
                        })
                        .collect()
                })
                .collect();
            let corners: Vec<[f64; 2]> = loops.iter().flatten().copied().collect();
            let index = Outlines::new(loops.clone());
            for k in 0..400 {
                let p = corners[rng.random_range(0..corners.len())];
                let far = [0.0, 1e-6, 0.5, 20.0][k % 4];
                let (x, y) = (p[0] + far * rng.random_range(-1.0..1.0), p[1] + far * rng.random_range(-1.0..1.0));
                assert_eq!(index.hold(x, y), loops.iter().any(|l| contains(l, x, y)), "{case}: {x} {y}");
            }
        }
        assert!(!Outlines::new(vec![]).hold(0.0, 0.0));
    }
}
