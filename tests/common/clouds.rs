//! In: two clouds of the same pictures and station. Out: how far their points are apart, and points that only one of
//! them has.
//! Frame and unit: mm; places in the pictures in px.

use sheetlight::scan::CloudPoint;

/// Points whose centres are nearer than this, px, are of the same skeleton pixel or of its neighbour on the same
/// stripe.
const SAME_PX: f32 = 0.05;
/// So many points in a row may be in one cloud only before the clouds are taken for different ones there.
const AHEAD: usize = 40;

/// What two clouds differ by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Apart {
    /// Points without a partner, of both.
    pub alone: usize,
    /// Largest distance of partners, mm.
    pub worst_mm: f64,
    /// Partners that are the same to the last bit.
    pub equal: usize,
}

/// Both clouds are in the order of shots and of skeleton pixels, so that partners come in the same order: several
/// pixels of a skeleton may have the same centre, and a search by place would mix them up.
pub fn apart(a: &[CloudPoint], b: &[CloudPoint]) -> Apart {
    let same = |p: &CloudPoint, q: &CloudPoint| p.shot == q.shot && (p.u - q.u).hypot(p.v - q.v) < SAME_PX;
    let mut out = Apart::default();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        if same(&a[i], &b[j]) {
            let (p, q) = (a[i].position.as_dvec3().to_array(), b[j].position.as_dvec3().to_array());
            let mm = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
            out.worst_mm = out.worst_mm.max(mm);
            out.equal += usize::from(a[i] == b[j]);
            (i, j) = (i + 1, j + 1);
            continue;
        }
        let steps = (1..=AHEAD).flat_map(|n| (0..=n).map(move |d| (d, n - d)));
        let next = steps.filter(|(d, e)| i + d < a.len() && j + e < b.len()).find(|(d, e)| same(&a[i + d], &b[j + e]));
        let (d, e) = next.unwrap_or((1, 1));
        (i, j, out.alone) = (i + d, j + e, out.alone + d + e);
    }
    out.alone += (a.len() - i) + (b.len() - j);
    out
}
