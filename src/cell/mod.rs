//! In: a scene and a seed. Out: a robot cell that exists only here: arm, controller, camera, lasers, gripper, at the level of
//! their wires; and its judge.
//! Frame and unit: base frame; mm, radians.
