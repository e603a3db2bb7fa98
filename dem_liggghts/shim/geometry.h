// Where a sphere meets segments and triangles: closest points and the double hierarchy, the rules of wall.py.
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

// Nodes of a triangle; a segment has two, its third entry repeats the first and never gets a weight.
using Element = std::array<int, 3>;

// Where a sphere meets an element. feature: 0 inside the element, 1 on an edge, 2 at a vertex.
struct Contact {
    int element, feature;
    double weight[3], distance;
    Vec offset;  // from the sphere's centre to the contact point
};

inline int nearest_on_segment(const Vec *node, const Vec &p, double *w)
{
    const Vec ab = node[1] - node[0];
    const double s = dot(p - node[0], ab) / dot(ab, ab);
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

// Double hierarchy (Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428), the rules of wall.py: keep the nearest,
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
