//! Converts the section `[paper]` of a deployment to the settings of the skeleton step.

use deployment::paper::Combine;

/// Returns the way in which a view's pose is computed from the poses of its pairs.
pub fn combine(from: Combine) -> pipeline::Combine {
    match from {
        Combine::Mean => pipeline::Combine::Mean,
        Combine::Consensus => pipeline::Combine::Consensus,
    }
}

#[cfg(test)]
mod tests {
    use deployment::{paper, person};
    use pipeline::SkeletonSettings;

    use super::*;

    #[test]
    fn the_defaults_equal_those_of_the_step() {
        let step = SkeletonSettings::default();
        assert_eq!(combine(paper::Config::default().combine), step.combine);
        assert_eq!(person::Config::default().joints, step.joints.name);
    }
}
