// Where a sphere meets segments and triangles: closest points and the double hierarchy, the rules of hierarchy.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

struct Vec {
    double x = 0, y = 0, z = 0;
    Vec() = default;
    Vec(double a, double b, double c) : x(a), y(b), z(c) {}
    explicit Vec(const double *p) : x(p[0]), y(p[1]), z(p[2]) {}
    void copy_to(double *p) const { p[0] = x, p[1] = y, p[2] = z; }
};
inline Vec operator+(const Vec &a, const Vec &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec &a, const Vec &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, const Vec &a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vec &a, const Vec &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Nodes of a triangle; a segment has two, its third entry repeats the first and never gets a weight; a disc has one,
// repeated. type: atom type of the material; group: number of the wall; depth: -1, or how far below a one-sided wall a
// centre is still pushed out; disc: radius of a disc or 0; rim: in a plane whether that node is a free end, in space
// whether the edge opposite to it is free.
struct Element {
    int node[3], type, group;
    double depth, disc;
    bool rim[3];
};

// Where a sphere meets an element. feature: 0 inside the element, 1 on an edge, 2 at a vertex. distance: negative when
// the centre is behind a one-sided wall or in a disc. side: how far the centre is outside of such an element's plane.
struct Contact {
    int element, feature;
    double weight[3], distance, side;
    Vec offset;  // from the sphere's centre to the contact point
};

inline int nearest_on_segment(const Vec *node, const Vec &p, double *w)
{
    const Vec ab = node[1] - node[0];
    const double along = dot(p - node[0], ab), s = dot(ab, ab) > 0 ? along / dot(ab, ab) : 0;
    w[1] = std::min(std::max(s, 0.0), 1.0);
    w[0] = 1.0 - w[1];
    w[2] = 0.0;
    return s <= 0.0 || s >= 1.0 ? 1 : 0;  // a segment is the cut through a strip: its ends are edges
}

inline int nearest_on_triangle(const Vec *node, const Vec &p, double *w)
{
    // Ericson, Real-Time Collision Detection (2005), section 5.1.5
    const Vec ab = node[1] - node[0], ac = node[2] - node[0];
    const Vec ap = p - node[0], bp = p - node[1], cp = p - node[2];
    auto result = [w](double a, double b, double c, int feature) { return w[0] = a, w[1] = b, w[2] = c, feature; };
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp);
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0) return result(1, 0, 0, 2);
    if (d3 >= 0 && d4 <= d3) return result(0, 1, 0, 2);
    if (d6 >= 0 && d5 <= d6) return result(0, 0, 1, 2);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    const double on_ab = d1 / (d1 - d3), on_ac = d2 / (d2 - d6), on_bc = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return result(1 - on_ab, on_ab, 0, 1);
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return result(1 - on_ac, 0, on_ac, 1);
    if (va <= 0 && d4 >= d3 && d5 >= d6) return result(0, 1 - on_bc, on_bc, 1);
    const double v = vb / (va + vb + vc), u = vc / (va + vb + vc);
    return result(1 - v - u, v, u, 0);
}

inline bool before(const Contact &a, const Contact &b, double radius)
{
    if (std::fabs(a.distance - b.distance) < 1e-12 * radius && a.feature != b.feature) return a.feature < b.feature;
    return a.distance != b.distance ? a.distance < b.distance : a.element < b.element;
}

// Drop the contacts whose point lies on an element that comes nearer elsewhere, the rule of hierarchy.py: without it a large
// overlap with a surface that is bent inwards ever so little would make a contact of every vertex in reach.
inline void drop_shared(std::vector<Contact> &contacts, const std::vector<Element> &elements, double radius)
{
    auto holds = [&elements](const Contact &c, const Contact &g) {
        const int *nodes = elements[c.element].node, *other = elements[g.element].node;
        for (int k = 0; k < 3; k++)
            if (c.weight[k] != 0 && std::find(other, other + 3, nodes[k]) == other + 3) return false;
        return true;
    };
    const std::vector<Contact> all = contacts;
    auto shared = [&](const Contact &c) {
        return c.feature && std::any_of(all.begin(), all.end(), [&](const Contact &g) {
            return g.distance < c.distance - 1e-12 * radius && holds(c, g);
        });
    };
    contacts.erase(std::remove_if(contacts.begin(), contacts.end(), shared), contacts.end());
}

// Double hierarchy (Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428), the rules of hierarchy.py: keep the nearest,
// drop every other whose point lies on or beyond its tangent plane (a neighbour seen at a shared edge) or whose normal
// differs by less than one degree (a gently bent surface), go on with the rest. Real valleys keep two.
inline void keep_distinct(std::vector<Contact> &contacts, double radius)
{
    static const double coplanar = std::cos(M_PI / 180.0);
    for (auto nearest = contacts.begin(); nearest != contacts.end(); ++nearest) {
        auto best = nearest;
        for (auto c = nearest + 1; c != contacts.end(); ++c)
            if (before(*c, *best, radius)) best = c;
        std::swap(*nearest, *best);
        const Contact g = *nearest;
        auto redundant = [&g](const Contact &c) {
            const double cosine = dot(c.offset, g.offset);
            return cosine >= g.distance * g.distance * (1 - 1e-9) || cosine >= c.distance * g.distance * coplanar;
        };
        contacts.erase(std::remove_if(nearest + 1, contacts.end(), redundant), contacts.end());
    }
}

// Unit normal of an element to the outside; angle: what the element fills at the point with these weights.
inline Vec outward(const Vec *node, int corners, const double *weight, double &angle)
{
    const Vec a = node[1] - node[0];
    angle = M_PI;
    if (corners == 2) return 1 / std::sqrt(a.x * a.x + a.y * a.y) * Vec(-a.y, a.x, 0);
    const Vec b = node[2] - node[0], n(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    for (int k = 0; k < 3; k++) {
        if (weight[k] != 1) continue;
        const Vec u = node[(k + 1) % 3] - node[k], v = node[(k + 2) % 3] - node[k];
        angle = std::acos(dot(u, v) / std::sqrt(dot(u, u) * dot(v, v)));
    }
    return 1 / std::sqrt(dot(n, n)) * n;
}

// Distance of a centre from a wall with two sides, as a fraction of the radius, at which it must stop before
// the wall under the force of now.
static const double THROUGH = 0.05;

// Distance, as a fraction of the radius, below which the element's own normal tells the direction.
static const double on_surface = 1e-8;

// Fill side of a contact with a one-sided element; infinite at a free end or edge. A centre on the element is put a
// little outside.
inline void look_outside(Contact &c, const Element &element, const Vec *node, int corners, double radius)
{
    c.side = HUGE_VAL;
    for (int k = 0; k < corners; k++)
        if (element.rim[k] && c.weight[k] == (corners == 2 ? 1 : 0)) return;
    double angle;
    const Vec normal = outward(node, corners, c.weight, angle);
    if (c.distance < on_surface * radius) {
        c.distance = on_surface * radius;
        c.offset = -c.distance * normal;
    }
    c.side = -angle * dot(normal, c.offset);
}

// What a wall that pushes outwards only makes of the candidates, the rules of hierarchy.py: outside, those behind which the
// centre lies are dropped; inside, the closest point alone pushes, down to depth.
inline void keep_outward(std::vector<Contact> &contacts, double radius, double depth)
{
    if (contacts.empty()) return;
    auto order = [radius](const Contact &a, const Contact &b) { return before(a, b, radius); };
    const Contact nearest = *std::min_element(contacts.begin(), contacts.end(), order);
    double side = 0;
    for (const Contact &c : contacts)
        if (c.distance <= nearest.distance + 1e-9 * radius) side += c.side;
    if (side < 0 || nearest.distance <= on_surface * radius) {
        contacts.assign(nearest.distance <= depth || side >= 0 ? 1 : 0, nearest);
        for (Contact &c : contacts) c.distance = side < 0 ? -c.distance : c.distance;
        return;
    }
    auto drop = [&](const Contact &c) {
        return c.distance > radius || (c.side < 0 && c.element != nearest.element);
    };
    contacts.erase(std::remove_if(contacts.begin(), contacts.end(), drop), contacts.end());
    keep_distinct(contacts, radius);
}
