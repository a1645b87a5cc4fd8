//! In: cameras with every kind of lens. Out: whether pixels, rays, derivatives and files agree with each other and
//! with OpenCV's numbers. Frame and unit: camera frame, mm; px.

use super::*;
use crate::geometry::{Vec2, Vec3};
use proptest::prelude::*;

/// The paper's camera with a lens similar to those of the reference rigs.
fn paper() -> Intrinsics {
    Intrinsics {
        fx: 611.6,
        fy: 611.6,
        cx: 314.962,
        cy: 232.344,
        skew: 0.0,
        distortion: [-0.118, 0.086, 0.00062, -0.00041, -0.017].into(),
        width: 640,
        height: 480,
    }
}

type Points = [[f64; 2]; 5];

/// cv2.projectPoints (OpenCV 4.14.0) of P = (12.5 -33 400), (-160 90 380), (205 150 420), (0 0 250), (-90 -140 310) by
/// fx 1812.5, fy 1806.75, cx 1021.25, cy 770.5 and these terms, no rotation, no translation.
const OPENCV: [(&[f64], Points); 5] = [
    (
        &[-0.31, 0.12, 0.0011, -0.0007, -0.02],
        [
            [1077.731748180, 621.850711109],
            [307.367250441, 1171.082931424],
            [1818.570716959, 1353.120078807],
            [1021.25, 770.5],
            [537.008669870, 20.765304658],
        ],
    ),
    (
        &[0.42, -0.21, 0.0006, -0.0004, 0.013, 0.71, -0.05, 0.027],
        [
            [1077.750276103, 621.806058553],
            [307.681893669, 1170.766831733],
            [1815.292950485, 1350.253805134],
            [1021.25, 770.5],
            [537.584836895, 21.155300329],
        ],
    ),
    (
        &[-0.12, 0.05, 0.0004, 0.0009, 0.01, 0.0, 0.0, 0.0, 0.004, -0.0015, -0.003, 0.0021],
        [
            [1077.906302182, 621.547005643],
            [279.647857179, 1186.517336305],
            [1877.356681123, 1391.617423617],
            [1021.25, 770.5],
            [513.728562965, -21.131281899],
        ],
    ),
    (
        &[-0.09, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.19, -0.11],
        [
            [1077.500915864, 621.850853324],
            [269.655284389, 1181.242269580],
            [2003.445993689, 1516.290141080],
            [1021.25, 770.5],
            [558.284889855, 34.136081807],
        ],
    ),
    (
        &[0.42, -0.21, 0.0006, -0.0004, 0.013, 0.71, -0.05, 0.027, 0.004, -0.0015, -0.003, 0.0021, -0.13, 0.16],
        [
            [1078.865758957, 620.837133245],
            [273.816860540, 1172.210447279],
            [1745.760230832, 1309.366862603],
            [1021.25, 770.5],
            [480.445429559, -79.557777691],
        ],
    ),
];

#[test]
fn every_lens_projects_as_opencv_does() {
    let points =
        [[12.5, -33.0, 400.0], [-160.0, 90.0, 380.0], [205.0, 150.0, 420.0], [0.0, 0.0, 250.0], [-90.0, -140.0, 310.0]];
    for (terms, pixels) in OPENCV {
        let distortion = Distortion::from_opencv(terms).unwrap();
        let k = Intrinsics {
            fx: 1812.5,
            fy: 1806.75,
            cx: 1021.25,
            cy: 770.5,
            skew: 0.0,
            distortion,
            width: 2048,
            height: 1536,
        };
        for (p, want) in points.iter().zip(pixels) {
            let px = k.pixel_from_point(&Vec3::from(*p)).unwrap();
            assert!((px - Vec2::from(want)).norm() < 2e-9, "{terms:?} {px} {want:?}");
            let ray = k.ray_from_pixel(&px).unwrap().direction;
            assert!((ray / ray.z - Vec3::from(*p) / p[2]).norm() < 1e-12);
        }
    }
}

/// Terms of a realistic lens, drawn from the whole range: barrel to 15 % and more, pincushion, rational, prism,
/// tilted.
fn any_lens() -> impl Strategy<Value = Distortion> {
    let brown = (-0.35f64..0.25, -0.1f64..0.15, -0.003f64..0.003, -0.003f64..0.003, -0.05f64..0.05);
    let rational =
        prop_oneof![Just([0.0; 3]), (-0.2f64..0.8, -0.05f64..0.3, 0.0f64..0.05).prop_map(|t| [t.0, t.1, t.2])];
    let prism = prop_oneof![Just([0.0; 4]), [-0.005f64..0.005, -0.005..0.005, -0.005..0.005, -0.005..0.005]];
    let tilt = prop_oneof![Just([0.0; 2]), [-0.35f64..0.35, -0.35..0.35]];
    (brown, rational, prism, tilt).prop_map(|((k1, k2, p1, p2, k3), [k4, k5, k6], [s1, s2, s3, s4], [x, y])| {
        // A rational factor is a quotient: the difference of k1 and k4 causes the distortion.
        Distortion([k1 + k4, k2 + k5, p1, p2, k3 + k6, k4, k5, k6, s1, s2, s3, s4, x, y])
    })
}

/// Newton's method jumps over both folds of this lens, radial and tangential, to a point where its determinant is
/// positive again.
#[test]
fn what_is_turned_by_half_a_turn_beyond_two_folds_is_no_ray() {
    let lens = Distortion::from([0.2452318549799642, 0.11399441860892635, 0.0, 0.0, -0.03042951380470863]);
    let n = Vec2::new(-1.0149661733579052, 0.751867944605663);
    assert!((lens.undistort(&lens.distort(&n)).unwrap() - n).norm() < 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    /// Inside the region around the axis where the lens is one to one, up to its edge, distorting and undistorting
    /// returns the same ray. Every returned ray lies in that region.
    #[test]
    fn lenses_are_inverted_where_they_are_one_to_one(lens in any_lens(), x in -1.1f64..1.1, y in -1.1f64..1.1) {
        let n = Vec2::new(x, y);
        let d = lens.distort(&n);
        if (1..=64).all(|i| {
            let j = lens.jacobian(&(n * (f64::from(i) / 64.0)));
            j.determinant() > 0.02 && j.iter().all(|v| v.is_finite())
        }) {
            let back = lens.undistort(&d);
            prop_assert!(back.is_some(), "{:?} {:?}", lens, n);
            prop_assert!((back.unwrap() - n).norm() < 1e-9, "{:?} {:?} {:?}", lens, n, back);
        } else if let Some(back) = lens.undistort(&d) {
            prop_assert!((lens.distort(&back) - d).norm() < 1e-9 && lens.connected(&back));
        }
    }
    #[test]
    fn the_jacobians_are_the_derivatives(lens in any_lens(), x in -0.6f64..0.6, y in -0.5f64..0.5) {
        let (n, h) = (Vec2::new(x, y), 1e-6);
        let (j, by) = (lens.jacobian(&n), lens.by_terms(&n));
        for c in 0..2 {
            let mut e = Vec2::zeros();
            e[c] = h;
            let d = (lens.distort(&(n + e)) - lens.distort(&(n - e))) / (2.0 * h);
            prop_assert!((d - j.column(c)).norm() < 1e-7, "{:?}", lens);
        }
        for c in 0..TERMS {
            let (mut up, mut down) = (lens, lens);
            up.0[c] += h;
            down.0[c] -= h;
            let d = (up.distort(&n) - down.distort(&n)) / (2.0 * h);
            prop_assert!((d - by.column(c)).norm() < 1e-7, "term {} of {:?}", c, lens);
        }
    }
    #[test]
    fn a_ray_projects_back_to_its_pixel(u in -0.5f64..639.5, v in -0.5f64..479.5, z in 50.0f64..500.0) {
        let cam = paper();
        let ray = cam.ray_from_pixel(&Vec2::new(u, v)).unwrap();
        let back = cam.pixel_from_point(&(ray.direction * z)).unwrap();
        prop_assert!((back - Vec2::new(u, v)).norm() < 1e-9);
    }
    /// Binned and cropped pictures have the same rays, whatever the lens.
    #[test]
    fn scaling_and_cutting_keep_the_rays(lens in any_lens(), u in 60.0f64..580.0, v in 60.0f64..420.0,
        left in 0u32..64, top in 0u32..64) {
        let whole = Intrinsics { distortion: lens, fx: 900.0, fy: 897.0, skew: 0.3, ..paper() };
        let fine = whole.scaled_to(1920, 960);
        let part = whole.region(f64::from(left), f64::from(top), 512, 400);
        // The outer edge of the first pixel is at -0.5 at any resolution.
        let at = Vec2::new((u + 0.5) * 3.0 - 0.5, (v + 0.5) * 2.0 - 0.5);
        let (a, b) = (whole.ray_from_pixel(&Vec2::new(u, v)), fine.ray_from_pixel(&at));
        let c = part.ray_from_pixel(&Vec2::new(u - f64::from(left), v - f64::from(top)));
        match (a, b, c) {
            (Some(a), Some(b), Some(c)) => {
                prop_assert!((a.direction - b.direction).norm() < 1e-9 && (a.direction - c.direction).norm() < 1e-9);
            }
            (a, b, c) => prop_assert!(a.is_none() && b.is_none() && c.is_none()),
        }
    }
    #[test]
    fn files_give_back_what_was_written(lens in any_lens()) {
        let k = Intrinsics { distortion: lens, ..paper() };
        let text = serde_json::to_string(&k).unwrap();
        prop_assert_eq!(serde_json::from_str::<Intrinsics>(&text).unwrap(), k);
        prop_assert_eq!(k.with_parameters(&k.parameters()), k);
    }
}

#[test]
fn files_of_five_terms_are_read_as_ever_and_two_keys_are_refused() {
    let text = |keys: &str| {
        format!("{{\"fx\": 600, \"fy\": 600, \"cx\": 320, \"cy\": 240, {keys} \"width\": 640, \"height\": 480}}")
    };
    let read = |keys: &str| serde_json::from_str::<Intrinsics>(&text(keys)).map_err(|e| e.to_string());
    let old = read("\"distortion_k1_k2_p1_p2_k3\": [-0.1, 0.02, 0.001, 0.002, 0.003],").unwrap();
    assert_eq!(old.distortion, [-0.1, 0.02, 0.001, 0.002, 0.003].into());
    assert!(serde_json::to_string(&old).unwrap().contains("distortion_k1_k2_p1_p2_k3"));
    let new = read("\"distortion_opencv\": [-0.1, 0.02, 0.001, 0.002, 0.003, 0.4, 0.5, 0.6],").unwrap();
    assert_eq!(new.distortion.to_opencv().len(), 8);
    assert!(read("\"distortion_opencv\": [0.1, 0.2, 0.3],").unwrap_err().contains("3 terms"));
    assert!(read("").unwrap_err().contains("neither"));
    let both = "\"distortion_opencv\": [0, 0, 0, 0], \"distortion_k1_k2_p1_p2_k3\": [0, 0, 0, 0, 0],";
    assert!(read(both).unwrap_err().contains("both"));
    let tilted = read("\"distortion_opencv\": [0,0,0,0,0, 0,0,0, 0,0,0,0, 12.0, 0],").unwrap();
    assert!(tilted.check().unwrap_err().to_string().contains("radians"));
}
