//! In: insertion poses. Out: whether the programs that are written for robots hold these poses, read back by their
//! own rules.
//! Frame and unit: mm, degrees.

use sheetlight::geometry::{Base, Rigid, Tool, Vec3};
use sheetlight::robot::program::{Insertion, Language, program};
use sheetlight::robot::{Convention, fanuc_tp};

fn insertion() -> Insertion {
    let at = |z: f64| Rigid::<Base, Tool>::from_vectors(&Vec3::new(0.02, -0.01, 1.4), Vec3::new(412.125, -30.5, z));
    Insertion { approach: at(90.0), insertion: at(60.0), retract: at(120.0) }
}

/// The numbers between two marks of the n-th line that holds the first.
fn numbers(text: &str, from: &str, to: &str, n: usize) -> Vec<f64> {
    let line = text.lines().filter(|l| l.contains(from)).nth(n).unwrap_or_else(|| panic!("no {from} in\n{text}"));
    let body = &line[line.find(from).unwrap() + from.len()..];
    let body = &body[..body.find(to).unwrap()];
    body.split([',', ' ', '[', ']']).filter_map(|w| w.parse().ok()).collect()
}

fn near(pose: &Rigid<Base, Tool>, convention: Convention, numbers: &[f64]) {
    let (angle, mm) = convention.read::<Base, Tool>(numbers).unwrap().difference(pose);
    assert!(angle < 1e-5 && mm < 1e-3, "{convention:?} {numbers:?}: {angle} {mm}");
}

#[test]
fn programs_hold_the_poses_in_order() {
    let at = insertion();
    let poses = [at.approach, at.insertion, at.retract];
    let of = |language| program(language, "led 2x12", &at, 50.0);
    for (k, pose) in poses.iter().enumerate() {
        near(pose, Convention::Denso, &numbers(&of(Language::PacScript), "P(", ", -1)", k));
        near(pose, Convention::Ur, &numbers(&of(Language::UrScript), "p[", "]", k));
        near(pose, Convention::Kuka, &numbers(&of(Language::Krl), "LIN {", "}", k));
        near(pose, Convention::Abb, &numbers(&of(Language::Rapid), ":= [[", ",[0,0,0,0]", k));
        let read = fanuc_tp::read::<Base, Tool>(&of(Language::Tp)).unwrap();
        near(pose, Convention::Fanuc, &Convention::Fanuc.write(&read[k].pose));
    }
    assert!(of(Language::UrScript).contains("v=0.0500") && of(Language::Tp).contains("50mm/sec"));
    for &language in Language::ALL {
        let name: &str = language.into();
        let text = of(language);
        let [down, open] = ["insertion", "open the gripper"].map(|w| text.rfind(w).unwrap());
        assert!(
            text.matches("open the gripper").count() == 1
                && (language == Language::Tp || down < open || language == Language::Rapid),
            "{name}"
        );
        assert_eq!(name.parse(), Ok(language));
    }
}

/// Rotations whose numbers follow from the makers' definitions by hand.
#[test]
fn notations_of_other_makers_say_what_they_mean() {
    let read = |c: Convention, n: &[f64]| c.read::<Base, Tool>(n).unwrap().rotation;
    // O A T: about z, then about the new y, then about the new z: 90, 90, 0 takes x to -z.
    let r = read(Convention::Kawasaki, &[0.0, 0.0, 0.0, 90.0, 90.0, 0.0]);
    assert!((r * Vec3::x() + Vec3::z()).norm() < 1e-12 && (r * Vec3::y() + Vec3::x()).norm() < 1e-12);
    // Rx·Ry·Rz: 90, 0, 90 takes x first to y, then to z.
    let r = read(Convention::Gba, &[0.0, 0.0, 0.0, 90.0, 0.0, 90.0]);
    assert!((r * Vec3::x() - Vec3::z()).norm() < 1e-12);
    // A captured answer of Denso's P2T for RX 180, RZ 180.
    let r = read(Convention::DensoT, &[300.0, 0.0, 590.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]);
    assert!((r - read(Convention::Denso, &[300.0, 0.0, 590.0, 180.0, 0.0, 180.0])).norm() < 1e-12);
    for a in [0.0, 180.0] {
        let n = [1.0, 2.0, 3.0, 25.0, a, 40.0];
        let pose = Convention::Kawasaki.read::<Base, Tool>(&n).unwrap();
        let again = Convention::Kawasaki.read::<Base, Tool>(&Convention::Kawasaki.write(&pose)).unwrap();
        assert!(again.difference(&pose).0 < 1e-7, "A = {a}");
    }
}
