//! In: the hot pixels of two sets of pictures of one size. Out: whether both sets were read out of the sensor in the
//! same way, and if not, how the second differs from the first.
//! Frame and unit: px, columns before rows.

use super::HotPixels;
use crate::fault::{Fault, Result};
use std::collections::{HashMap, HashSet};

/// How pictures differ from others of the same camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadOut {
    /// Mirrored or turned: rows and columns are exchanged first, then the order of columns and of rows is reversed.
    /// `moved` is the shift that remains after that.
    Turned {
        /// Rows and columns are exchanged.
        transposed: bool,
        /// Whether the order of columns, and of rows, is reversed.
        reversed: [bool; 2],
        /// Shift of the second set relative to the first, px.
        moved: [i32; 2],
    },
    /// The two sets have no more hot pixels in common than those of two sensors, however they are turned or moved.
    Another,
}

/// How the read-out of two sets of pictures differs, and on what evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Otherwise {
    /// How the second set differs from the first.
    pub how: ReadOut,
    /// Number of hot pixels that agree with this, and number of those in the smaller set.
    pub alike: [usize; 2],
}

/// Least number of hot pixels that must agree where the picture is only turned, and where it is also moved.
const FEWEST_TURNED: usize = 2;
const FEWEST_MOVED: usize = 3;
/// At least this share of the smaller set, in tenths, must agree too: long lists agree somewhere by chance.
const TENTHS: usize = 3;
/// Least number of hot pixels in each set for the verdict that the sensors differ. The second is a multiple of the mean
/// number that agrees by chance: more than that is not chance.
const FEWEST_OF_ANOTHER: usize = 4;
const MORE_THAN_CHANCE: f64 = 4.0;
/// Most entries of a longer calibrated list that are compared, evenly chosen: every pair is examined.
const MOST: usize = 400;

impl HotPixels {
    /// How pictures with these hot pixels differ from pictures with those of `calibrated`, both `size` large. `None`:
    /// they do not differ, or there are too few hot pixels to decide.
    ///
    /// The positions of hot pixels are a property of the sensor. With a dozen in 640x480, two that agree after a turn,
    /// or three after a move, occur by chance in one of a million sets.
    pub fn otherwise(&self, calibrated: &HotPixels, size: [u32; 2]) -> Option<Otherwise> {
        let step = calibrated.count().div_ceil(MOST).max(1);
        let calibrated: Vec<[u32; 2]> = calibrated.places().iter().copied().step_by(step).collect();
        let smaller = self.count().min(calibrated.len());
        let enough = |fewest: usize| fewest.max((TENTHS * smaller).div_ceil(10));
        let here: HashSet<&[u32; 2]> = self.places().iter().collect();
        let alike = calibrated.iter().filter(|p| here.contains(p)).count();
        if alike >= enough(1) {
            return None;
        }
        let votes = orientations(size).map(|(transposed, reversed)| {
            let (moved, votes) = best_move(self.places(), &calibrated, size, transposed, reversed);
            (ReadOut::Turned { transposed, reversed, moved }, moved, votes)
        });
        let (how, moved, votes) = votes.max_by_key(|(_, moved, votes)| (*votes, *moved == [0; 2]))?;
        let fewest = if moved == [0; 2] { FEWEST_TURNED } else { FEWEST_MOVED };
        if votes >= enough(fewest) && votes > alike {
            return Some(Otherwise { how, alike: [votes, smaller] });
        }
        let [w, h] = size.map(f64::from);
        let by_chance = self.count() as f64 * calibrated.len() as f64 / (w * h);
        let another = smaller >= FEWEST_OF_ANOTHER && alike as f64 <= MORE_THAN_CHANCE * by_chance;
        another.then_some(Otherwise { how: ReadOut::Another, alike: [alike, smaller] })
    }
}

impl Otherwise {
    /// A sentence on pictures that may come from another sensor.
    ///
    /// # Errors
    /// The pictures are turned, mirrored or moved: the calibration does not hold for them.
    pub fn remark(&self) -> Result<String> {
        let [alike, of] = self.alike;
        match self.how {
            ReadOut::Another => Ok(format!(
                "the pictures may be of another camera than the calibrated one, or of another region of its sensor: \
                 {alike} of {of} hot pixels lie in the same places"
            )),
            how => Err(Fault::refused(format!("the pictures are {how}, compared with those of the calibration"))
                .cause(format!(
                    "{alike} of {of} hot pixels agree with this change: the camera's ReverseX, ReverseY or region, or \
                     a driver's flip, was changed after the calibration"
                ))
                .next("set the camera as it was at its calibration, or calibrate it again")),
        }
    }
}

/// All turns and mirrorings of a picture that preserve its size; the unchanged picture is first.
fn orientations([w, h]: [u32; 2]) -> impl Iterator<Item = (bool, [bool; 2])> {
    (0..if w == h { 8 } else { 4 }).map(|i| (i & 4 != 0, [i & 1 != 0, i & 2 != 0]))
}

/// The most frequent move from a calibrated hot pixel, turned in this way, to a seen one, and the number of pairs with
/// it.
fn best_move(
    seen: &[[u32; 2]],
    calibrated: &[[u32; 2]],
    [w, h]: [u32; 2],
    transposed: bool,
    [columns, rows]: [bool; 2],
) -> ([i32; 2], usize) {
    let turned = |[x, y]: [i32; 2]| {
        let [x, y] = if transposed { [y, x] } else { [x, y] };
        [if columns { w as i32 - 1 - x } else { x }, if rows { h as i32 - 1 - y } else { y }]
    };
    let mut votes: HashMap<[i32; 2], usize> = HashMap::new();
    for [a, b] in signed(calibrated).map(turned) {
        signed(seen).for_each(|[x, y]| *votes.entry([x - a, y - b]).or_default() += 1);
    }
    // Among equal counts the smallest move is taken, then the first in order: the answer is the same each time.
    let smallest = |[x, y]: [i32; 2]| (x.abs() + y.abs(), x, y);
    let best = votes.into_iter().max_by_key(|(moved, n)| (*n, std::cmp::Reverse(smallest(*moved))));
    best.unwrap_or(([0; 2], 0))
}

fn signed(places: &[[u32; 2]]) -> impl Iterator<Item = [i32; 2]> {
    places.iter().map(|p| p.map(|v| v as i32))
}

impl std::fmt::Display for ReadOut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ReadOut::Turned { transposed, reversed, moved } = self else { return f.write_str("of another sensor") };
        let turned = match (transposed, reversed) {
            (false, [false, false]) => "",
            (false, [true, true]) => "turned by 180 degrees",
            (false, [true, false]) => "mirrored left to right",
            (false, [false, true]) => "mirrored top to bottom",
            (true, [true, false]) => "turned by 90 degrees to the right",
            (true, [false, true]) => "turned by 90 degrees to the left",
            (true, _) => "mirrored about a diagonal",
        };
        let [x, y] = moved;
        match (turned, [*x, *y] == [0; 2]) {
            (turned, true) => f.write_str(turned),
            ("", false) => write!(f, "moved by {x} columns and {y} rows"),
            (turned, false) => write!(f, "{turned} and moved by {x} columns and {y} rows"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Image;
    use rand::{Rng, SeedableRng};

    const SIZE: [u32; 2] = [64, 48];

    /// The list that a set of dark pictures with these hot pixels gives.
    fn hot(places: &[[i32; 2]], [w, h]: [u32; 2]) -> HotPixels {
        let mut pixels = vec![3u8; (w * h) as usize];
        places.iter().for_each(|&[x, y]| pixels[(y * w as i32 + x) as usize] = 200);
        let image = Image::from_u8(w, h, pixels);
        HotPixels::of_all(&vec![HotPixels::may_be(&image); 3], (w * h) as usize)
    }

    fn turned(places: &[[i32; 2]], of: impl Fn([i32; 2]) -> [i32; 2]) -> Vec<[i32; 2]> {
        places.iter().map(|p| of(*p)).collect()
    }

    const SENSOR: [[i32; 2]; 6] = [[5, 7], [12, 40], [33, 9], [40, 30], [55, 21], [60, 44]];

    #[test]
    fn pictures_read_alike_are_accused_of_nothing() {
        let known = hot(&SENSOR, SIZE);
        assert_eq!(known.count(), 6);
        assert_eq!(known.otherwise(&known, SIZE), None);
        // Half of them are hidden and others are added: a longer exposure, a warmer sensor.
        let warmer = [&SENSOR[..3], &[[20, 20], [21, 44], [50, 3], [9, 9]]].concat();
        assert_eq!(hot(&warmer, SIZE).otherwise(&known, SIZE), None);
        // Too few to decide.
        assert_eq!(hot(&[[20, 20], [50, 3]], SIZE).otherwise(&known, SIZE), None);
        assert_eq!(HotPixels::default().otherwise(&known, SIZE), None);
        assert_eq!(known.otherwise(&HotPixels::default(), SIZE), None);
    }

    #[test]
    fn each_way_to_read_a_sensor_otherwise_is_named() {
        let known = hot(&SENSOR, SIZE);
        let said = |places: &[[i32; 2]]| hot(places, SIZE).otherwise(&known, SIZE).expect("told").how.to_string();
        assert_eq!(said(&turned(&SENSOR, |[x, y]| [63 - x, 47 - y])), "turned by 180 degrees");
        assert_eq!(said(&turned(&SENSOR, |[x, y]| [63 - x, y])), "mirrored left to right");
        assert_eq!(said(&turned(&SENSOR[..2], |[x, y]| [x, 47 - y])), "mirrored top to bottom");
        assert_eq!(said(&turned(&SENSOR, |[x, y]| [x - 3, y + 2])), "moved by -3 columns and 2 rows");
        let both = said(&turned(&SENSOR, |[x, y]| [62 - x, y]));
        assert_eq!(both, "mirrored left to right and moved by -1 columns and 0 rows");
        assert_eq!(said(&[[20, 20], [50, 3], [9, 9], [30, 41]]), "of another sensor");
        let square = hot(&SENSOR, [64, 64]);
        let right = hot(&turned(&SENSOR, |[x, y]| [63 - y, x]), [64, 64]);
        assert_eq!(right.otherwise(&square, [64, 64]).unwrap().how.to_string(), "turned by 90 degrees to the right");
    }

    /// Lists that have nothing in common agree somewhere by chance: no turn or move may be reported for that.
    #[test]
    fn long_lists_of_two_sensors_are_told_to_be_two() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let mut some = |n: usize| HotPixels::random(n, [640, 480], &mut rng);
        for n in [4, 20, 100, 2000] {
            let (a, b) = (some(n), some(n));
            assert_eq!(b.otherwise(&a, [640, 480]).expect("told").how, ReadOut::Another, "{n}");
            assert_eq!(a.otherwise(&a, [640, 480]), None);
        }
    }

    impl HotPixels {
        fn random(n: usize, [w, h]: [u32; 2], rng: &mut impl Rng) -> HotPixels {
            let places: Vec<[u32; 2]> = (0..n).map(|_| [rng.random_range(0..w), rng.random_range(0..h)]).collect();
            HotPixels::of_all(&vec![places; 3], (w * h) as usize)
        }
    }
}
