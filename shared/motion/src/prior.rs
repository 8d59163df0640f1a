//! Expected jerk densities of people's joints.

use crate::noise::Prior;
use crate::role::Role;

/// Returns the expected jerk density of a joint with a given role.
///
/// The values are our own: maximum-likelihood estimates, rounded, from the ten synthetic actions of seed 1, which are not used for any
/// evaluation. The spread is wide, so a run of a few seconds outweighs the expected value.
pub fn prior(role: Option<Role>) -> Prior {
    let log10_jerk = match role {
        Some(
            Role::Wrist(_) | Role::Ankle(_) | Role::Heel(_) | Role::BigToe(_) | Role::SmallToe(_),
        ) => 1.6,
        Some(Role::Knee(_) | Role::Elbow(_)) | None => 1.2,
        Some(Role::Head | Role::Neck | Role::Pelvis | Role::Shoulder(_) | Role::Hip(_)) => 0.5,
    };
    Prior {
        log10_jerk,
        sd: 1.2,
    }
}
