//! What finds people where a deployment does not say: the network that ships, or the filters.

use std::path::PathBuf;

use crate::fuse::Views;
use crate::pose::{Precision, Search};
use crate::{Deployment, SHIPPED, is_shipped};

/// Lets the network that ships find people, unless the deployment names something else, or asks for what only the filters have.
pub(crate) fn settle(it: &mut Deployment, given: &toml::Table) {
    let says_network = given
        .get("pose")
        .is_some_and(|it| it.get("network").is_some());
    if !says_network && !it.has_maps() && !asks_for_filters(it) {
        it.pose.network = Some(PathBuf::from(SHIPPED));
    }
}

/// Whether there is a setting that says something of the filters alone, or of the paper's energy, which their poses are made for.
fn asks_for_filters(it: &Deployment) -> bool {
    let fuse = &it.fuse;
    it.model.is_some()
        || it.needs_pairs()
        || matches!(fuse.views, Some(Views::Pairs | Views::All))
        || it.has_quality()
        || fuse.consistency.is_some()
        || !fuse.compatibility.is_empty()
        || it.pose.search != Search::Full
        || it.pose.precision != Precision::F32
        || !is_shipped(&it.pose.orientation)
        || !is_shipped(&it.triangulate.joint_map)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::{AnyMachine, Deployment, Loaded};

    fn parsed(more: &str) -> Deployment {
        let cameras =
            "[[camera]]\nname = 'a'\nsource = 'a.mp4'\n[[camera]]\nname = 'b'\nsource = 'b.mp4'\n";
        let text = format!("name = 'n'\nrig = 'r'\noutput = 'o'\n{cameras}{more}");
        let loaded = Loaded::parse(&text, Path::new("n.toml"), &[], &AnyMachine);
        loaded.unwrap().deployment
    }

    #[test]
    fn the_network_that_ships_finds_people_where_nothing_is_said() {
        let network = parsed("").pose.network;
        assert_eq!(network.as_deref(), Some(Path::new("shipped")));
        let also = parsed("[pose]\ncandidates = 4\n[capture]\nscale = 0.5\n");
        assert!(also.has_maps());
    }

    #[test]
    fn whoever_asks_for_what_only_the_filters_have_gets_the_filters() {
        for more in [
            "[pose]\nnetwork = 'none'\n",
            "[pose]\nsearch = 'tracked'\n",
            "[pose]\norientation = 'none'\n",
            "[quality]\nnetwork = 'shipped'\n",
            "[fuse]\nviews = 'pairs'\n",
            "[fuse]\nworkers = 2\n",
            "[fuse]\nconsistency = 'shipped'\n",
            "[triangulate]\njoint_map = 'none'\n",
        ] {
            assert!(!parsed(more).has_maps(), "{more}");
        }
    }
}
