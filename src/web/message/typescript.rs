//! In: the messages' types. Out: their TypeScript declarations, which the pages' editors and tests read.
//! Frame and unit: none.

use super::*;
use ts_rs::TS;

/// `docs/messages.d.ts`; a test holds the file against this.
pub fn declarations() -> String {
    let all = [
        of_bar(),
        of_orders(),
        of_outcomes(),
        of_motion(),
        of_door(),
        of_station(),
        of_recipes(),
        of_surface(),
        of_sweep(),
    ]
    .concat();
    let body: Vec<String> = all.iter().map(|d| format!("export {d}")).collect();
    format!(
        "// Made from src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.\n\n{}\n",
        body.join("\n\n")
    )
}

/// What the bar shows; how a job stands, and what went wrong.
fn of_bar() -> Vec<String> {
    vec![
        Mode::decl(),
        RobotState::decl(),
        Frames::decl(),
        CalibrationAge::decl(),
        Lease::decl(),
        Bar::decl(),
        JobState::decl(),
        Problem::decl(),
    ]
}

/// What can be ordered.
fn of_orders() -> Vec<String> {
    vec![
        Target::decl(),
        TeachOrder::decl(),
        Plain::decl(),
        ScanOrder::decl(),
        Filter::decl(),
        Filters::decl(),
        Filtered::decl(),
        FilterOrder::decl(),
        FindOrder::decl(),
        TouchOrder::decl(),
        CalibrateOrder::decl(),
        JointOrder::decl(),
        AutoOrder::decl(),
        InsertOrder::decl(),
        BenchmarkOrder::decl(),
        Order::decl(),
    ]
}

/// What came of an order, and the camera that an outcome may show.
fn of_outcomes() -> Vec<String> {
    vec![
        CheckLine::decl(),
        ScanFigures::decl(),
        Notation::decl(),
        RobotPoses::decl(),
        Term::decl(),
        GateLight::decl(),
        Position::decl(),
        SurfaceTouched::decl(),
        SquareProposed::decl(),
        Touched::decl(),
        CalibrationFigures::decl(),
        Inserted::decl(),
        StripeSeen::decl(),
        PictureLook::decl(),
        ExposureSet::decl(),
        CameraFeature::decl(),
        CameraState::decl(),
        SetFeature::decl(),
        BenchRow::decl(),
        KeptUp::decl(),
        Outcome::decl(),
        Job::decl(),
    ]
}

/// What moves the robot, and what viewers are told.
fn of_motion() -> Vec<String> {
    vec![Asked::decl(), SimulatedCell::decl(), MotionState::decl(), Arming::decl(), InTheCell::decl(), Event::decl()]
}

/// Who may come in and what they confirm.
fn of_door() -> Vec<String> {
    vec![Knock::decl(), Session::decl(), TakeLease::decl(), Confirmed::decl(), Grant::decl(), Redeem::decl()]
}

/// The station: calibrations, settings, recordings.
fn of_station() -> Vec<String> {
    vec![
        CalibrationState::decl(),
        FrameInfo::decl(),
        StationInfo::decl(),
        BackupInfo::decl(),
        SettingsState::decl(),
        SettingsAsk::decl(),
        OutputAsk::decl(),
        RecordingInfo::decl(),
        BoardView::decl(),
        ViewRef::decl(),
        SupportAsk::decl(),
        PictureRef::decl(),
    ]
}

/// Recipes and their drawings.
fn of_recipes() -> Vec<String> {
    vec![
        RecipeText::decl(),
        RecipeAsk::decl(),
        PointsOf::decl(),
        RecipePoint::decl(),
        NewPoint::decl(),
        PointChange::decl(),
        PointsChange::decl(),
        PointsChanged::decl(),
        DrawingAsk::decl(),
        DrawingRead::decl(),
    ]
}

/// A scan looked at, and measured in.
fn of_surface() -> Vec<String> {
    vec![
        MapHead::decl(),
        Outlines::decl(),
        Ghost::decl(),
        SectionAsk::decl(),
        SectionPoint::decl(),
        Distance::decl(),
        Fit::decl(),
        Section::decl(),
        PointsAsk::decl(),
        PlaneAsk::decl(),
        Measure::decl(),
        MeasureAnswer::decl(),
    ]
}

/// A sweep before it is made, and how places repeat.
fn of_sweep() -> Vec<String> {
    vec![SweepAsk::decl(), Pace::decl(), SweepPlan::decl(), RepeatsAsk::decl(), Spread::decl(), Repeats::decl()]
}
