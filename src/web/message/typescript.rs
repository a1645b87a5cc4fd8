//! In: the messages' types. Out: their TypeScript declarations, which the pages' editors and tests read.
//! Frame and unit: none.

use super::*;
use ts_rs::TS;

/// `docs/messages.d.ts`; a test holds the file against this.
pub fn declarations() -> String {
    let all = [
        Mode::decl(),
        RobotState::decl(),
        Frames::decl(),
        CalibrationAge::decl(),
        Lease::decl(),
        Bar::decl(),
        JobState::decl(),
        Problem::decl(),
        Target::decl(),
        TeachOrder::decl(),
        Plain::decl(),
        ScanOrder::decl(),
        FindOrder::decl(),
        TouchOrder::decl(),
        CalibrateOrder::decl(),
        JointOrder::decl(),
        AutoOrder::decl(),
        InsertOrder::decl(),
        Order::decl(),
        CheckLine::decl(),
        ScanFigures::decl(),
        Notation::decl(),
        RobotPoses::decl(),
        Term::decl(),
        GateLight::decl(),
        Position::decl(),
        SurfaceTouched::decl(),
        Touched::decl(),
        CalibrationFigures::decl(),
        Inserted::decl(),
        BenchRow::decl(),
        Outcome::decl(),
        Job::decl(),
        Asked::decl(),
        SimulatedCell::decl(),
        MotionState::decl(),
        Arming::decl(),
        InTheCell::decl(),
        Event::decl(),
        Knock::decl(),
        Session::decl(),
        TakeLease::decl(),
        Confirmed::decl(),
        Grant::decl(),
        Redeem::decl(),
        CalibrationState::decl(),
        StationInfo::decl(),
        RecordingInfo::decl(),
        BoardView::decl(),
        PictureRef::decl(),
        RecipeText::decl(),
        MapHead::decl(),
        SectionAsk::decl(),
        SectionPoint::decl(),
        Distance::decl(),
        Fit::decl(),
        Section::decl(),
        PointsAsk::decl(),
        PlaneAsk::decl(),
        Measure::decl(),
        MeasureAnswer::decl(),
    ];
    let body: Vec<String> = all.iter().map(|d| format!("export {d}")).collect();
    format!(
        "// Made from src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.\n\n{}\n",
        body.join("\n\n")
    )
}
