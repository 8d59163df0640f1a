//! How restless joints of people are.

use crate::noise::Prior;
use crate::role::Role;

/// Returns the expectation for a joint by its role.
///
/// Our own, rounded: what the likelihood alone finds in the ten synthetic actions of seed 1, which nothing is judged by. The spread is
/// wide: a run of some seconds outweighs it.
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
