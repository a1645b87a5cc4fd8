//! In: normal equations whose parameters fall into shared ones and blocks that share no residual with each other.
//! Out: their solution, their inverse and condition, by elimination of the blocks.
//! Frame and unit: none (docs/math.md, Least squares (6), (7)).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Parameters from `first` on form blocks of `size`, and no residual touches two blocks. An example: the boards' poses
/// of a camera calibration, each seen in one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocks {
    /// Index of the first parameter in a block; those before it are shared.
    pub first: usize,
    /// Number of parameters in a block.
    pub size: usize,
}

/// The free parameters: shared ones, then block by block.
pub(super) struct Order {
    width: usize,
    shared: Vec<usize>,
    blocks: Vec<Vec<usize>>,
}

impl Order {
    pub fn new(width: usize, hold: &[usize], blocks: Option<Blocks>) -> Order {
        let free = |from: usize, to: usize| (from..to).filter(|i| !hold.contains(i)).collect::<Vec<usize>>();
        let Some(Blocks { first, size }) = blocks else {
            return Order { width, shared: free(0, width), blocks: Vec::new() };
        };
        let each = (first..width).step_by(size).map(|at| free(at, (at + size).min(width)));
        Order { width, shared: free(0, first), blocks: each.filter(|b| !b.is_empty()).collect() }
    }
    /// All free parameters.
    pub fn free(&self) -> Vec<usize> {
        self.shared.iter().chain(self.blocks.iter().flatten()).copied().collect()
    }
    /// The parameters that have a matrix element with a parameter of `block`.
    fn touching<'a>(&'a self, block: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        self.shared.iter().chain(block).copied()
    }
}

/// The factorised equations.
pub(super) struct Factor<'a> {
    order: &'a Order,
    /// Factor for the shared parameters after elimination of the blocks (their Schur complement).
    shared: Cholesky<f64, Dyn>,
    own: Vec<Cholesky<f64, Dyn>>,
    /// For each block, how it follows the shared parameters, D⁻¹E.
    follow: Vec<DMatrix<f64>>,
}

impl<'a> Factor<'a> {
    /// `at` gives an element of the lower triangle: row, column. `None` where the matrix is not positive definite.
    pub fn new(order: &'a Order, at: impl Fn(usize, usize) -> f64) -> Option<Factor<'a>> {
        let at = |i: usize, j: usize| if i >= j { at(i, j) } else { at(j, i) };
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| at(rows[i], columns[j]))
        };
        let mut schur = part(&order.shared, &order.shared);
        let (mut own, mut follow) = (Vec::new(), Vec::new());
        for block in &order.blocks {
            let factor = part(block, block).cholesky()?;
            let mixed = part(block, &order.shared);
            let by_shared = factor.solve(&mixed);
            schur.gemm_tr(-1.0, &mixed, &by_shared, 1.0);
            own.push(factor);
            follow.push(by_shared);
        }
        let shared = if order.shared.is_empty() { DMatrix::identity(0, 0) } else { schur }.cholesky()?;
        Some(Factor { order, shared, own, follow })
    }

    /// The solution x of A x = b; zero for held parameters.
    pub fn solve(&self, b: &DVector<f64>) -> Vec<f64> {
        let of = |indices: &[usize]| DVector::from_iterator(indices.len(), indices.iter().map(|&i| b[i]));
        let mut right = of(&self.order.shared);
        for (block, follow) in self.order.blocks.iter().zip(&self.follow) {
            right.gemv_tr(-1.0, follow, &of(block), 1.0);
        }
        let mut x = vec![0.0; self.order.width];
        let shared = self.shared.solve(&right);
        self.order.shared.iter().zip(shared.iter()).for_each(|(&i, v)| x[i] = *v);
        for ((block, own), follow) in self.order.blocks.iter().zip(&self.own).zip(&self.follow) {
            let own = own.solve(&of(block)) - follow * &shared;
            block.iter().zip(own.iter()).for_each(|(&i, v)| x[i] = *v);
        }
        x
    }

    /// The inverse; rows and columns of held parameters are zero.
    pub fn inverse(&self) -> DMatrix<f64> {
        let order = self.order;
        let shared = self.shared.inverse();
        let mut all = DMatrix::zeros(order.width, order.width);
        let mut put = |rows: &[usize], columns: &[usize], m: &DMatrix<f64>| {
            for (a, &i) in rows.iter().enumerate() {
                for (b, &j) in columns.iter().enumerate() {
                    (all[(i, j)], all[(j, i)]) = (m[(a, b)], m[(a, b)]);
                }
            }
        };
        put(&order.shared, &order.shared, &shared);
        let moved: Vec<DMatrix<f64>> = self.follow.iter().map(|f| -f * &shared).collect();
        for (k, block) in order.blocks.iter().enumerate() {
            put(block, &order.shared, &moved[k]);
            for (l, other) in order.blocks.iter().enumerate().take(k + 1) {
                let mut m = -&moved[k] * self.follow[l].transpose();
                if k == l {
                    m += self.own[k].inverse();
                }
                put(block, other, &m);
            }
        }
        all
    }
}

/// Inverse and reciprocal condition of a symmetric matrix given by its lower triangle, after scaling its diagonal
/// to one. No inverse where the condition is below 1e-14.
pub(super) fn inverse(order: &Order, lower: &DMatrix<f64>) -> (Option<DMatrix<f64>>, f64) {
    let free = order.free();
    if free.is_empty() {
        return (Some(DMatrix::zeros(order.width, order.width)), 1.0);
    }
    if free.iter().any(|&i| lower[(i, i)] <= 0.0 || !lower[(i, i)].is_finite()) {
        return (None, 0.0);
    }
    let mut d = vec![0.0; order.width];
    free.iter().for_each(|&i| d[i] = 1.0 / lower[(i, i)].sqrt());
    let scaled = |i: usize, j: usize| lower[(i, j)] * d[i] * d[j];
    let Some(mut inverse) = Factor::new(order, scaled).map(|f| f.inverse()) else { return (None, 0.0) };
    // The 1-norm of the scaled matrix. A block's parameters have elements only with each other and with the shared
    // ones.
    let both = |i: usize, j: usize| if i >= j { scaled(i, j) } else { scaled(j, i) };
    let column = |j: usize| -> f64 {
        match order.blocks.iter().find(|b| b.contains(&j)) {
            Some(block) => order.touching(block).map(|i| both(i, j).abs()).sum(),
            None => free.iter().map(|&i| both(i, j).abs()).sum(),
        }
    };
    let norm = free.iter().map(|&j| column(j)).fold(0.0, f64::max);
    let norm_inverse = inverse.column_iter().map(|c| c.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let condition = 1.0 / (norm * norm_inverse);
    if !(condition > 1e-14) {
        return (None, condition);
    }
    for j in 0..order.width {
        for i in 0..order.width {
            inverse[(i, j)] *= d[i] * d[j];
        }
    }
    (Some(inverse), condition)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Three shared parameters and four blocks of two, two parameters held: the result equals that of dense equations.
    #[test]
    fn blocks_give_what_dense_equations_give() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(8);
        let (width, hold) = (11, [1, 6]);
        let mut h = DMatrix::zeros(width, width);
        for k in 0..40 {
            let block = 3 + 2 * (k % 4);
            let mut j = DVector::zeros(width);
            for i in [0, 1, 2, block, block + 1] {
                j[i] = rng.random::<f64>() - 0.5;
            }
            h += &j * j.transpose();
        }
        let b = DVector::from_fn(width, |i, _| i as f64 - 4.0);
        let dense = Order::new(width, &hold, None);
        let blocks = Order::new(width, &hold, Some(Blocks { first: 3, size: 2 }));
        let free = dense.free();
        let plain = DMatrix::from_fn(free.len(), free.len(), |i, j| h[(free[i], free[j])]).try_inverse().unwrap();
        for order in [&dense, &blocks] {
            let (inverse, condition) = super::inverse(order, &h);
            let inverse = inverse.unwrap();
            let x = Factor::new(order, |i, j| h[(i, j)]).unwrap().solve(&b);
            for (a, &i) in free.iter().enumerate() {
                let want: f64 = free.iter().enumerate().map(|(c, &j)| plain[(a, c)] * b[j]).sum();
                assert!((x[i] - want).abs() < 1e-9 * want.abs().max(1.0), "x[{i}] {} {want}", x[i]);
                for (c, &j) in free.iter().enumerate() {
                    assert!((inverse[(i, j)] - plain[(a, c)]).abs() < 1e-9, "({i}, {j})");
                }
            }
            assert!(hold.iter().all(|&i| x[i] == 0.0 && inverse.row(i).amax() == 0.0));
            assert!((condition / super::inverse(&dense, &h).1 - 1.0).abs() < 1e-9, "{condition}");
        }
    }
}
