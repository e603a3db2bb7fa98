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
inline Vec cross(const Vec &a, const Vec &b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double dot(const Vec &a, const Vec &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Nodes of a triangle; a segment has two, its third entry repeats the first and never gets a weight; a disc has one,
// repeated. type: atom type of the material; group: number of the wall; depth: -1, or how far below a one-sided wall a
// centre is still pushed out; disc: radius of a disc or 0; rim: in a plane whether that node is a free end, in space
// whether the edge opposite to it is free; joint: the first node of the wall in the same place.
struct Element {
    int node[3], type, group;
    double depth, disc;
    bool rim[3];
    int joint[3];
};

// Where a sphere meets an element. feature: 0 inside the element, 1 on an edge, 2 at a vertex. distance: negative when
// the centre is behind a one-sided wall or in a disc. side: how far the centre is outside of such an element's plane.
// share: of the force that the nearest of the contacts that share it would have alone; nearest: the distance of that one;
// follows: its element, or -1.
struct Contact {
    int element, feature;
    double weight[3], distance, side;
    Vec offset;  // from the sphere's centre to the contact point
    double share = 1, nearest = 0;
    int follows = -1;
    bool dropped = false;
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

// How an element turns with its nodes: angular velocity sum_a lever_a (area . v_a), as in rolling.py; zero for a disc.
struct Levers {
    Vec lever[3], area;
};

inline Levers levers_of(const Vec *node, int corners, bool disc)
{
    Levers out;
    if (disc) return out;
    const Vec ab = node[1] - node[0], ac = node[2] - node[0];
    if (corners == 2) {
        out.area = {-ab.y, ab.x, 0};
        out.lever[0].z = -1, out.lever[1].z = 1;
    } else {
        out.area = {ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z, ab.x * ac.y - ab.y * ac.x};
        for (int a = 0; a < 3; a++) out.lever[a] = node[(a + 2) % 3] - node[(a + 1) % 3];
    }
    const double size2 = dot(out.area, out.area);
    for (Vec &lever : out.lever) lever = size2 > 0 ? 1 / size2 * lever : Vec();
    return out;
}

inline bool before(const Contact &a, const Contact &b, double radius)
{
    if (std::fabs(a.distance - b.distance) >= 1e-12 * radius) return a.distance < b.distance;
    return a.feature != b.feature ? a.feature < b.feature : a.element < b.element;  // never by round-off
}

inline void erase_dropped(std::vector<Contact> &contacts)
{
    auto dropped = [](const Contact &c) { return c.dropped; };
    contacts.erase(std::remove_if(contacts.begin(), contacts.end(), dropped), contacts.end());
}

// Drop the contacts whose point lies on an element that comes nearer elsewhere, the rule of hierarchy.py: without it a large
// overlap with a surface that is bent inwards ever so little would make a contact of every vertex in reach. holds(c, e):
// whether the element e holds the point of c.
template <class Holds> void drop_shared(std::vector<Contact> &contacts, double radius, Holds holds)
{
    for (Contact &c : contacts)
        c.dropped = c.feature && std::any_of(contacts.begin(), contacts.end(), [&](const Contact &g) {
            return g.distance < c.distance - 1e-12 * radius && holds(c, g.element);
        });
    erase_dropped(contacts);
}

static const double coplanar = std::cos(M_PI / 180.0);  // directions that differ by less are one
static const double joined = 0.01;  // distance, as a fraction of the overlap, over which surfaces hang together

inline bool same_direction(const Contact &g, const Contact &c)
{
    return dot(c.offset, g.offset) >= g.distance * c.distance * coplanar;
}

// How far the point of c lies above the tangent plane of g, towards the centre.
inline double height(const Contact &c, const Contact &g)
{
    return dot(g.offset, g.offset - c.offset) / std::fabs(g.distance);
}

// Let c follow g, or drop it when its point is not above the tangent plane of g or of another one that follows g.
inline void follow(const Contact &g, Contact &c, std::vector<Contact> &contacts, double radius)
{
    const double flat = 1e-12 * radius;
    if (!(height(c, g) > flat)) c.dropped = true;
    for (Contact &o : contacts) {
        if (&o == &c || o.follows != g.element || o.dropped || c.dropped) continue;
        if (!(height(c, o) > flat)) c.dropped = true;
        else if (!(height(o, c) > flat)) o.dropped = true;
    }
    c.follows = g.element;
}

// Double hierarchy (Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428), the rules of hierarchy.py: keep the nearest,
// drop every other whose point lies on or beyond its tangent plane (a neighbour seen at a shared edge), go on with the
// rest; one whose normal differs by less than one degree (a gently bent surface) follows it. Real valleys keep two.
inline void keep_distinct(std::vector<Contact> &contacts, double radius)
{
    auto open = [](const Contact &c) { return !c.dropped && c.follows < 0; };
    for (auto nearest = contacts.begin();; ++nearest) {
        auto best = contacts.end();
        for (auto c = nearest; c != contacts.end(); ++c)
            if (open(*c) && (best == contacts.end() || before(*c, *best, radius))) best = c;
        if (best == contacts.end()) break;
        std::swap(*nearest, *best);
        for (auto c = nearest + 1; c != contacts.end(); ++c) {
            if (!open(*c)) continue;
            if (same_direction(*nearest, *c)) follow(*nearest, *c, contacts, radius);
            else if (dot(c->offset, nearest->offset) >= nearest->distance * nearest->distance * (1 - 1e-9))
                c->dropped = true;
        }
    }
    erase_dropped(contacts);
}

// Contacts that follow another one share its force with it, in proportion to their heights above the planes of the others,
// the rule of hierarchy.py.
inline void share_force(std::vector<Contact> &contacts)
{
    for (Contact &c : contacts) c.nearest = c.distance;
    if (std::none_of(contacts.begin(), contacts.end(), [](const Contact &c) { return c.follows >= 0; })) return;
    for (size_t leader = 0; leader < contacts.size(); leader++) {
        if (contacts[leader].follows >= 0) continue;
        const int element = contacts[leader].element;
        auto member = [&](size_t c) { return c == leader || contacts[c].follows == element; };
        std::vector<double> heights(contacts.size(), HUGE_VAL);
        double total = 0;
        for (size_t c = 0; c < contacts.size(); c++) {
            if (!member(c)) continue;
            for (size_t o = 0; o < contacts.size(); o++)
                if (o != c && member(o)) heights[c] = std::min(heights[c], std::max(height(contacts[c], contacts[o]), 0.0));
            total += heights[c];
        }
        for (size_t c = 0; c < contacts.size(); c++)
            if (member(c) && total < HUGE_VAL) {
                contacts[c].share = total > 0 ? heights[c] / total : c == leader;
                contacts[c].nearest = contacts[leader].distance;
            }
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
