//! Collapse of the binary tree into the wide tree. Dynamic programming over the surface area cost chooses the
//! binary nodes that become children of each wide node, and those that become leaves (Ylitie, Karras, Laine
//! 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.1).
//!
//! cost[i - 1] of a binary node is the least cost of a forest of at most `i` roots that represents it.

use super::binary::{BinaryNode, left_child, right_child};
use super::layout::{Child, LEAF_MAX, Node, WIDTH, ranks};
use super::references::Reference;
use crate::scene::Mesh;
use glam::Vec4Swizzles;

/// Cost of visiting a node, in units of the surface area heuristic.
const NODE_COST: f32 = 1.0;
/// Cost of opening a leaf.
const LEAF_COST: f32 = 1.3;
/// Cost of each triangle of a leaf.
const TRIANGLE_COST: f32 = 0.08;

/// Least costs of a forest of 1 … 7 roots. The eighth entry is the cost of a leaf, or infinite.
pub(super) type Costs = [f32; 8];

fn leaf_cost(node: &BinaryNode) -> f32 {
    let n = node.count();
    if n > LEAF_MAX { f32::INFINITY } else { node.half_area() * (LEAF_COST + TRIANGLE_COST * n as f32) }
}

/// Least cost of `roots` roots over two subtrees, and the number of roots of the left one.
#[inline(always)]
fn distribute(left: &Costs, right: &Costs, roots: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for k in 1..roots {
        let cost = left[k - 1] + right[roots - k - 1];
        if cost < best.0 {
            best = (cost, k);
        }
    }
    best
}

/// Fills `costs` for every node, children before parents.
pub(super) fn evaluate(nodes: &[BinaryNode], costs: &mut [Costs]) {
    for index in (0..nodes.len()).rev() {
        let node = &nodes[index];
        let leaf = leaf_cost(node);
        costs[index] = if node.count() == 1 {
            [leaf; 8]
        } else {
            let (left, right) = (&costs[left_child(index)], &costs[right_child(nodes, index)]);
            let inner = node.half_area() * NODE_COST + distribute(left, right, WIDTH).0;
            let mut own = [leaf.min(inner); 8];
            for roots in 2..WIDTH {
                own[roots - 1] = own[roots - 2].min(distribute(left, right, roots).0);
            }
            own[7] = leaf;
            own
        };
    }
}

/// Memory of the wide tree.
pub(super) struct Output<'a> {
    pub nodes: &'a mut [Node],
    pub coordinates: &'a mut [f32],
    pub triangles: &'a mut [u32],
    /// Nodes and triangles written.
    pub used: (usize, usize),
}

/// Binary nodes chosen as children of one wide node, with the index of their first reference.
struct Children {
    chosen: [(usize, usize); WIDTH],
    count: usize,
}

pub(super) struct Emitter<'a> {
    pub mesh: Mesh<'a>,
    pub references: &'a [Reference],
    pub binary: &'a [BinaryNode],
    pub costs: &'a [Costs],
    /// Margin of the boxes.
    pub slack: f32,
    /// Makes a leaf wherever one fits and divides the largest box first: at most one node for seven
    /// references in any scene.
    pub frugal: bool,
}

impl Emitter<'_> {
    /// Writes the whole tree after the used part, and returns its root; `None` if it does not fit.
    pub(super) fn emit(&self, out: &mut Output) -> Option<Child> {
        let before = out.used;
        let root = self.node(0, 0, out);
        if root.is_none() {
            out.used = before;
        }
        root.map(Child::node)
    }

    /// Writes the wide node of binary node `index` and its subtree. The child of the least cost per area
    /// comes last: any-hit rays pop it from the stack first.
    fn node(&self, index: usize, first: usize, out: &mut Output) -> Option<u32> {
        let at = out.used.0;
        *out.nodes.get_mut(at)? = Node::EMPTY;
        out.used.0 += 1;
        let children =
            if self.frugal { self.largest_first(index, first) } else { self.cheapest(index, first) };
        let children = self.by_effort(&children);
        for (slot, &(child, first)) in children.chosen[..children.count].iter().enumerate() {
            let content = if self.is_leaf(child) {
                self.leaf(child, first, out)?
            } else {
                Child::node(self.node(child, first, out)?)
            };
            let binary = &self.binary[child];
            let (lo, hi) = (binary.lo.xyz() - self.slack, binary.hi.xyz() + self.slack);
            out.nodes[at].set(slot, lo.to_array(), hi.to_array(), content);
        }
        out.nodes[at].order();
        Some(at as u32)
    }

    /// The children in order of descending cost per area.
    fn by_effort(&self, children: &Children) -> Children {
        let mut efforts = [f32::NEG_INFINITY; WIDTH];
        for (effort, &(child, _)) in efforts.iter_mut().zip(&children.chosen[..children.count]) {
            *effort = self.costs[child][0] / self.binary[child].half_area();
        }
        let mut sorted = Children { chosen: [(0, 0); WIDTH], count: children.count };
        for (rank, child) in ranks(efforts).into_iter().zip(children.chosen) {
            sorted.chosen[rank as usize % WIDTH] = child;
        }
        sorted
    }

    fn is_leaf(&self, index: usize) -> bool {
        let node = &self.binary[index];
        let [cheapest, .., leaf] = self.costs[index];
        node.count() == 1 || (node.count() <= LEAF_MAX && (self.frugal || leaf <= cheapest))
    }

    fn leaf(&self, index: usize, first: usize, out: &mut Output) -> Option<Child> {
        let count = self.binary[index].count();
        let at = out.used.1;
        let references = self.references.get(first..first + count)?;
        // Parts of one triangle in the same leaf are tested once.
        let mut ids = [u32::MAX; LEAF_MAX];
        let mut kept = 0;
        for r in references {
            if !ids[..kept].contains(&r.triangle()) {
                ids[kept] = r.triangle();
                kept += 1;
            }
        }
        out.triangles.get_mut(at..at + kept)?.copy_from_slice(&ids[..kept]);
        let runs = out.coordinates.get_mut(9 * at..9 * (at + kept))?;
        for (i, &id) in ids[..kept].iter().enumerate() {
            for (c, corner) in self.mesh.corners(id).iter().enumerate() {
                for axis in 0..3 {
                    runs[(3 * c + axis) * kept + i] = corner[axis];
                }
            }
        }
        out.used.1 += kept;
        Some(Child::leaf(at as u32, kept as u32))
    }

    /// The children of least cost by the dynamic programme.
    fn cheapest(&self, index: usize, first: usize) -> Children {
        let mut children = Children { chosen: [(0, 0); WIDTH], count: 0 };
        if self.is_leaf(index) {
            // Only the root can be a leaf here: a tree of one leaf.
            children.chosen[0] = (index, first);
            children.count = 1;
        } else {
            self.divide(index, first, WIDTH, &mut children);
        }
        children
    }

    fn divide(&self, index: usize, first: usize, roots: usize, children: &mut Children) {
        let (left, right) = (left_child(index), right_child(self.binary, index));
        let (_, k) = distribute(&self.costs[left], &self.costs[right], roots);
        let middle = first + self.binary[left].count();
        self.choose(left, first, k, children);
        self.choose(right, middle, roots - k, children);
    }

    /// Adds the forest of at most `roots` roots that represents `index` at the least cost.
    fn choose(&self, index: usize, first: usize, roots: usize, children: &mut Children) {
        let costs = &self.costs[index];
        // The fewest roots that reach the least cost.
        let mut roots = roots;
        while roots > 1 && costs[roots - 2] <= costs[roots - 1] {
            roots -= 1;
        }
        if roots == 1 {
            children.chosen[children.count % WIDTH] = (index, first);
            children.count += 1;
        } else {
            self.divide(index, first, roots, children);
        }
    }

    fn largest_first(&self, index: usize, first: usize) -> Children {
        let mut children = Children { chosen: [(index, first); WIDTH], count: 1 };
        // The node itself is divided even if it fits into a leaf, unless it is a single reference.
        let mut next = (!self.is_leaf(index)).then_some(0);
        while let Some(slot) = next {
            let (node, first) = children.chosen[slot];
            let (left, right) = (left_child(node), right_child(self.binary, node));
            children.chosen[slot] = (left, first);
            children.chosen[children.count] = (right, first + self.binary[left].count());
            children.count += 1;
            let area = |i: &usize| self.binary[children.chosen[*i].0].half_area();
            next = (0..children.count)
                .filter(|&i| children.count < WIDTH && !self.is_leaf(children.chosen[i].0))
                .max_by(|a, b| area(a).total_cmp(&area(b)));
        }
        children
    }
}
