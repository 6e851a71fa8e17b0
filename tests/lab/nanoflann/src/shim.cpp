// nanoflann's tree over points that the caller keeps, as its own examples use it: L2_Simple, leaves of at most ten points.
#include <nanoflann.hpp>

#include <cstdint>
#include <utility>
#include <vector>

namespace {

struct Cloud {
    const float (*points)[3];
    size_t count;
    size_t kdtree_get_point_count() const { return count; }
    float kdtree_get_pt(size_t index, size_t axis) const { return points[index][axis]; }
    template <class Box> bool kdtree_get_bbox(Box&) const { return false; }
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, uint32_t>;

struct Tree {
    Cloud cloud;
    Index index;
    std::vector<uint32_t> numbers;
    std::vector<float> distances;
    std::vector<std::pair<uint32_t, float>> found;
    Tree(const float (*points)[3], size_t count)
        : cloud{points, count}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
        index.buildIndex();
    }
};

}  // namespace

extern "C" {

void* halflight_nanoflann_build(const float (*points)[3], size_t count) { return new Tree(points, count); }

void halflight_nanoflann_free(void* tree) { delete static_cast<Tree*>(tree); }

// The k nearest; those within a squared radius where it is finite.
size_t halflight_nanoflann_nearest(void* tree, const float* place, size_t k, float squared_radius) {
    Tree& t = *static_cast<Tree*>(tree);
    t.numbers.resize(k);
    t.distances.resize(k);
    nanoflann::KNNResultSet<float, uint32_t> set(k);
    set.init(t.numbers.data(), t.distances.data());
    if (squared_radius < 3.4e38f) t.distances[k - 1] = squared_radius;
    t.index.findNeighbors(set, place, nanoflann::SearchParams(0, 0.0f, false));
    return set.size();
}

// All within a squared radius, in no order.
size_t halflight_nanoflann_within(void* tree, const float* place, float squared_radius) {
    Tree& t = *static_cast<Tree*>(tree);
    return t.index.radiusSearch(place, squared_radius, t.found, nanoflann::SearchParams(0, 0.0f, false));
}
}
