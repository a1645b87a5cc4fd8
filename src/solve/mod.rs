//! In: residuals with Jacobians, point sets, seeds. Out: least-squares solutions with covariance,
//! robust weights, seeded consensus (RANSAC).
//! Frame and unit: none; the caller's.
