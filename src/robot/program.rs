//! In: the poses of an insertion. Out: the text of a program for a robot's controller: approach, insertion, retract
//! along straight lines.
//! Frame and unit: the tool in the robot's base frame, mm; in the text the units of each language; speed mm/s.

use super::Convention;
use crate::geometry::{Base, Rigid, Tool};

/// A robot programming language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Language {
    /// Denso PacScript.
    PacScript,
    /// Universal Robots.
    UrScript,
    /// KUKA.
    Krl,
    /// FANUC teach-pendant program (.LS).
    Tp,
    /// ABB.
    Rapid,
}

impl Language {
    /// All languages.
    pub const ALL: &[Language] = <Language as strum::VariantArray>::VARIANTS;
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Language>("language", word)
}

/// The tool's poses, in order.
#[derive(Clone, Copy, Debug)]
pub struct Insertion {
    /// Above the insertion.
    pub approach: Rigid<Base, Tool>,
    /// The inserted pose.
    pub insertion: Rigid<Base, Tool>,
    /// Above the insertion, on the way back.
    pub retract: Rigid<Base, Tool>,
}

/// What the reader of each program must know.
const HEAD: [&str; 3] = [
    "Written by sheetlight. Poses: the inserting tool in the robot's base frame.",
    "Select that tool and the base (work frame 0) before this is run; check the way at reduced speed first.",
    "The gripper is opened where the comment says so.",
];
const OPEN: &str = "open the gripper here";

/// The program's text. `name` becomes its name as far as the language allows; `speed_mm_s` is the tool's speed.
pub fn program(language: Language, name: &str, at: &Insertion, speed_mm_s: f64) -> String {
    let name: String = name.chars().filter(char::is_ascii_alphanumeric).take(20).collect();
    let name = if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("P{name}") };
    let poses = [("approach", &at.approach), ("insertion", &at.insertion), ("retract", &at.retract)];
    match language {
        Language::PacScript => pacscript(&name, &poses, speed_mm_s),
        Language::UrScript => urscript(&name, &poses, speed_mm_s),
        Language::Krl => krl(&name, &poses, speed_mm_s),
        Language::Tp => tp(&name, &poses, speed_mm_s),
        Language::Rapid => rapid(&name, &poses, speed_mm_s),
    }
}

type Named<'a> = [(&'static str, &'a Rigid<Base, Tool>); 3];

/// The pose's numbers as texts with a fixed count of digits.
fn list(convention: Convention, pose: &Rigid<Base, Tool>, digits: usize) -> Vec<String> {
    // Avoids "-0.000".
    let plain = |x: f64| format!("{:.digits$}", if x.abs() < 0.5 * 10f64.powi(-(digits as i32)) { 0.0 } else { x });
    convention.write(pose).into_iter().map(plain).collect()
}

fn head(comment: &str) -> String {
    HEAD.iter().map(|line| format!("{comment} {line}\n")).collect()
}

fn pacscript(name: &str, poses: &Named, speed: f64) -> String {
    // Straight motions of an RC8 are stated in per cent; the speed at 100 % depends on the arm.
    let mut out = head("'");
    out += &format!(
        "' Set the external speed so that a straight motion goes at {speed:.0} mm/s.\n' {name}\nSub Main\n  TakeArm \
         Keep = 1\n"
    );
    for (what, pose) in poses {
        out += &format!("  Move L, @E P({}, -1) ' {what}\n", list(Convention::Denso, pose, 4).join(", "));
        if *what == "insertion" {
            out += &format!("  ' {OPEN}\n");
        }
    }
    out + "  GiveArm\nEnd Sub\n"
}

fn urscript(name: &str, poses: &Named, speed: f64) -> String {
    let mut out = head("#") + &format!("def {}():\n", name.to_lowercase());
    for (what, pose) in poses {
        out += &format!(
            "  movel(p[{}], a=0.2, v={:.4}) # {what}\n",
            list(Convention::Ur, pose, 7).join(", "),
            speed * 1e-3
        );
        if *what == "insertion" {
            out += &format!("  # {OPEN}\n");
        }
    }
    out + "end\n"
}

fn krl(name: &str, poses: &Named, speed: f64) -> String {
    let mut out = format!("DEF {name}( )\n") + &head(";");
    out += &format!("$BASE = $NULLFRAME\n$VEL.CP = {:.4}\n", speed * 1e-3);
    for (what, pose) in poses {
        let keyed: Vec<String> = ["X", "Y", "Z", "A", "B", "C"]
            .iter()
            .zip(list(Convention::Kuka, pose, 4))
            .map(|(k, v)| format!("{k} {v}"))
            .collect();
        out += &format!("LIN {{{}}} ; {what}\n", keyed.join(", "));
        if *what == "insertion" {
            out += &format!("; {OPEN}\n");
        }
    }
    out + "END\n"
}

fn tp(name: &str, poses: &Named, speed: f64) -> String {
    let mut out = format!("/PROG  {}\n/ATTR\n/MN\n", name.to_uppercase());
    let mut lines: Vec<String> = HEAD.iter().map(|h| format!("!{}", h.chars().take(60).collect::<String>())).collect();
    for (k, (what, _)) in poses.iter().enumerate() {
        lines.push(format!("L P[{}] {speed:.0}mm/sec FINE", k + 1));
        if *what == "insertion" {
            lines.push(format!("!{OPEN}"));
        }
    }
    for (k, line) in lines.iter().enumerate() {
        out += &format!("{:4}:{line}    ;\n", k + 1);
    }
    out += "/POS\n";
    for (k, (what, pose)) in poses.iter().enumerate() {
        let n = list(Convention::Fanuc, pose, 4);
        out += &format!(
            "P[{}:\"{what}\"]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX = {} mm,\tY = {} \
             mm,\tZ = {} mm,\n\tW = {} deg,\tP = {} deg,\tR = {} deg\n}};\n",
            k + 1,
            n[0],
            n[1],
            n[2],
            n[3],
            n[4],
            n[5]
        );
    }
    out + "/END\n"
}

fn rapid(name: &str, poses: &Named, speed: f64) -> String {
    let mut out = format!("MODULE {name}\n") + &head("  !");
    for (what, pose) in poses {
        let n = list(Convention::Abb, pose, 6);
        out += &format!(
            "  CONST robtarget {what} := [[{}],[{}],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n",
            n[..3].join(","),
            n[3..].join(",")
        );
    }
    out += &format!(
        "  CONST speeddata slow := [{speed:.0},30,30,30];\n  ! The tool that inserts:\n  PERS tooldata inserting;\n  \
         PROC main()\n"
    );
    for (what, _) in poses {
        out += &format!("    MoveL {what}, slow, fine, inserting \\WObj:=wobj0;\n");
        if *what == "insertion" {
            out += &format!("    ! {OPEN}\n");
        }
    }
    out + "  ENDPROC\nENDMODULE\n"
}
