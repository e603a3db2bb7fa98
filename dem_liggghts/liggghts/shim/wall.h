// The fix wall/gran/nodal: walls of elements, of which the nodes of the last one move linearly within a window of DEM
// steps.
//
// The nodes are the same on every rank, so a LIGGGHTS mesh (distributed, rebuilt when it moves, coplanarity fixed when
// it is read) would only cost: the fix is one of LIGGGHTS' primitive walls with its search replaced. The primitive that
// the command must name is never used.
#pragma once
#include <mpi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "atom.h"
#include "bodies.h"
#include "error.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "geometry.h"
#include "models.h"
#include "modify.h"
#include "neighbor.h"
#include "squares.h"
#include "update.h"

using namespace LAMMPS_NS;

struct NotFinite {};  // thrown when a particle or a node is NaN or infinite

class FixWallNodal : public FixWallGran {
public:
    FixWallNodal(LAMMPS *lmp, int argc, char **argv) : FixWallGran(lmp, argc, argv) {}
    static Fix *create(LAMMPS *lmp, int argc, char **argv) { return new FixWallNodal(lmp, argc, argv); }

    // Nodes move along x + v t within the window, t = step_ * dt; impulse [N s] and force of this rank's particles. These
    // two have LAST more rows: moment about the origin of all walls on the particles, and mass times place of
    // these. In a plane the first number of a moment is that about z. Of the nodes of a terrain few are hit: hit_ and
    // loaded_ are the rows with an impulse and with a force, all others are zero.
    std::vector<Vec> x_, v_, impulse_, force_;
    std::vector<int> hit_, loaded_;
    std::vector<int> moving_;  // nodes that may move; all others are where they are
    Squares squares_;               // elements of walls in front of the one that moves

    // Per particle, SLOTS springs [element + 1, or 0 when free; history values], in the order of its contacts; kept in
    // a fix property/atom, so that they migrate with their particle.
    void post_create() override
    {
        if (!dnum_) return;
        std::vector<std::string> words = {"springs", "all", "property/atom", "springs", "vector", "no", "no", "no"};
        words.resize(8 + SLOTS * (1 + dnum_), "0.");
        std::vector<char *> argv;
        for (std::string &word : words) argv.push_back(&word[0]);
        modify->add_fix(int(argv.size()), argv.data());
        springs_ = static_cast<FixPropertyAtom *>(modify->find_fix_id("springs"));
        old_springs_.resize(SLOTS * (1 + dnum_));
    }

    // LIGGGHTS makes its tables of materials for the types it sees here and on particles, and reads beyond them else.
    int min_type() override { return 1; }
    int max_type() override { return atom->ntypes; }

    void init() override
    {
        FixWallGran::init();
        if (impl->contact_match("rolling_friction", "coulomb"))
            force->registry.connect("coeffRollFrict", rolling_, "fix wall/gran/nodal");
    }

    int setmask() override
    {
        return FixConst::INITIAL_INTEGRATE | FixConst::PRE_EXCHANGE | FixConst::PRE_NEIGHBOR | FixConst::POST_FORCE;
    }

    // Elements of walls from number ``own`` on, with the nodes from number ``first`` on; last those of the wall that
    // moves; no force on any. With ``keep``, springs on that wall as it was go to the new element closest to where they
    // were, or, when ``number`` is given, stay with the disc, which has that number now among those of the wall that
    // moves, or -1 when it is gone.
    void set_elements(int corners, int first, int own, const std::vector<Element> &elements, const std::vector<Vec> &x,
                      bool keep, const int *number)
    {
        std::vector<std::array<Vec, 3>> old;  // corners of the elements
        for (size_t e = own; keep && e < elements_.size(); e++) {
            const int *n = elements_[e].node;
            const double t = step_ * update->dt;
            old.push_back({position(n[0], t), position(n[1], t), position(n[2], t)});
        }
        corners_ = corners;
        own_ = own;
        elements_.resize(own);
        elements_.insert(elements_.end(), elements.begin(), elements.end());
        forget_impulse();
        forget(force_, loaded_);
        x_.resize(first);
        v_.resize(first);
        x_.insert(x_.end(), x.begin(), x.end());
        v_.resize(x_.size());
        impulse_.resize(x_.size() + LAST);
        force_.resize(x_.size() + LAST);
        is_hit_.resize(x_.size() + LAST);
        moving_.clear();
        start_window(0.0);
        stale_ = true;
        if (keep && springs_ && number) renumber_springs(number, own);
        else if (keep && springs_) move_springs(old, own);
    }

    void start_window(double length)  // x_ and v_ are set
    {
        forget_impulse();
        step_ = 0;
        length_ = length;
        const double allowed = 0.25 * neighbor->skin * neighbor->skin;
        x_listed_.resize(moving_.size());
        for (size_t m = 0; m < moving_.size(); m++) {
            const int n = moving_[m];
            const Vec start = x_[n] - x_listed_[m], end = start + length * v_[n];
            const double moved = std::max(dot(start, start), dot(end, end));
            if (!std::isfinite(dot(start, start) + dot(end, end))) throw NotFinite();
            if (moved > allowed) stale_ = true;
        }
    }

    // The nodes that may move are at x and move with v; numbers of these: moving_.
    void place(const std::vector<Vec> &x, const std::vector<Vec> &v)
    {
        for (size_t m = 0; m < moving_.size(); m++) x_[moving_[m]] = x[m], v_[moving_[m]] = v[m];
    }

    // Of the last step: it gives the first half kick of the next.
    void set_force(const std::vector<int> &rows, const std::vector<Vec> &force)
    {
        forget(force_, loaded_);
        for (size_t k = 0; k < rows.size(); k++)
            if (dot(force[k], force[k]) > 0) force_[rows[k]] = force[k], loaded_.push_back(rows[k]);
    }

    bool finite_particles() const
    {
        double sum = 0;
        for (int i = 0; i < atom->nlocal; i++) sum += dot(Vec(atom->x[i]), {1, 1, 1});
        return std::isfinite(sum);
    }

    // Of particle i: calls tell(element, values, their number) for each spring.
    template <class Tell> void each_spring(int i, Tell tell) const
    {
        for (int s = 0; springs_ && s < SLOTS && spring(i, s)[0] > 0; s++)
            tell(int(spring(i, s)[0]) - 1, spring(i, s) + 1, dnum_);
    }

    // rows: as in shim.cpp, of this particle at walls
    void set_springs(int i, const std::vector<const double *> &rows)
    {
        if (!springs_) return;
        if (rows.size() > SLOTS) error->one(FLERR, "a particle touches the wall at more than 32 places");
        std::fill_n(spring(i, 0), SLOTS * (1 + dnum_), 0.0);
        for (size_t s = 0; s < rows.size(); s++) {
            spring(i, int(s))[0] = -rows[s][1];
            std::copy_n(rows[s] + 2, dnum_, spring(i, int(s)) + 1);
        }
    }

    void initial_integrate(int) override { step_++; }
    void pre_neighbor() override { stale_ = true; }  // LIGGGHTS rebuilds its lists: particles are renumbered
    void pre_exchange() override                     // a NaN would become the index of a bin
    {
        int bad = !finite_particles(), any;
        MPI_Allreduce(&bad, &any, 1, MPI_INT, MPI_MAX, world);
        if (any) throw NotFinite();
    }

    static const int LAST = 2;

private:
    static const int SLOTS = 32;  // a sphere touches many small discs
    static constexpr double CLOSE = 0.1;  // as in history.py

    int corners_ = 3, step_ = 0;
    int own_ = 0;        // first element of the wall that moves
    double length_ = 0;  // of the window [s]
    bool stale_ = true;
    std::vector<Element> elements_;
    std::vector<Vec> x_listed_;           // those that may move at the end of the window in which the lists were made
    std::vector<char> is_hit_;            // whether a row is in hit_
    std::vector<std::vector<int>> near_;  // elements near each particle
    std::vector<Contact> contacts_;       // of one particle
    std::vector<Contact> found_;          // of one particle with one wall
    std::vector<double> old_springs_;
    FixPropertyAtom *springs_ = nullptr;
    double **rolling_ = nullptr;  // coefficients of rolling friction by types, or none

    Vec position(int node, double t) const { return x_[node] + t * v_[node]; }

    static void forget(std::vector<Vec> &values, std::vector<int> &rows)
    {
        for (int n : rows) values[n] = Vec();
        rows.clear();
    }

    void forget_impulse()
    {
        for (int n : hit_) is_hit_[n] = 0;
        forget(impulse_, hit_);
    }

    Contact nearest(int element, const Vec &p, double t, double radius = 0) const
    {
        const int *n = elements_[element].node;
        const Vec node[3] = {position(n[0], t), position(n[1], t), position(n[2], t)};
        Contact c = closest(node, p);
        c.element = element;
        if (radius > 0 && elements_[element].depth >= 0) look_outside(c, elements_[element], node, corners_, radius);
        if (const double disc = elements_[element].disc) {  // to its rim
            c.offset = ((c.distance - disc) / c.distance) * c.offset;
            c.distance -= disc;
        }
        return c;
    }

    Contact closest(const Vec *node, const Vec &p) const
    {
        Contact c;
        c.feature = corners_ == 2 ? nearest_on_segment(node, p, c.weight) : nearest_on_triangle(node, p, c.weight);
        c.offset = c.weight[0] * node[0] + c.weight[1] * node[1] + c.weight[2] * node[2] - p;
        c.distance = std::sqrt(dot(c.offset, c.offset));
        return c;
    }

    void renumber_springs(const int *number, int own)
    {
        for (int i = 0; i < atom->nlocal; i++) {
            int kept = 0;
            for (int s = 0; s < SLOTS && spring(i, s)[0] > 0; s++) {
                const int was = int(spring(i, s)[0]) - 1;
                const int now = was < own ? was : number[was - own] < 0 ? -1 : own + number[was - own];
                if (now < 0) continue;
                if (kept < s) std::copy(spring(i, s), spring(i, s) + 1 + dnum_, spring(i, kept));
                spring(i, kept++)[0] = now + 1;
            }
            for (; kept < SLOTS && spring(i, kept)[0] > 0; kept++) spring(i, kept)[0] = 0;
        }
    }

    void move_springs(const std::vector<std::array<Vec, 3>> &old, int own)
    {
        for (int i = 0; i < atom->nlocal; i++) {
            const Vec p(atom->x[i]);
            for (int s = 0; s < SLOTS && spring(i, s)[0] > 0; s++) {
                const int was = int(spring(i, s)[0]) - 1;
                if (was < own) continue;
                const Vec touched = p + closest(old[was - own].data(), p).offset;
                double shortest = HUGE_VAL;
                for (size_t e = own; e < elements_.size(); e++) {
                    const double distance = nearest(int(e), touched, 0.0).distance;
                    if (distance >= shortest) continue;
                    shortest = distance;
                    spring(i, s)[0] = e + 1;
                }
            }
        }
    }

    // Elements that a particle may touch before the lists are made anew: nearer than its radius and the skin, half of
    // which is for the particle and half for the nodes after this window, and than the way of the nodes in this window.
    // Of those that are not in squares elements far from all particles are left out first, the others sorted along their
    // longest axis, so that few distances are computed.
    void list_near_elements(double t)
    {
        struct Range {
            double low, high, travel, depth;
            int element;
        };
        std::vector<int> loose = squares_.loose;
        for (size_t e = own_; e < elements_.size(); e++) loose.push_back(int(e));
        double Vec::*axis = longest_axis(loose);
        std::vector<Range> ranges;
        double widest = 0, deepest = 0, largest = 0;
        Vec least(HUGE_VAL, HUGE_VAL, HUGE_VAL), most = -1.0 * least;
        for (int i = 0; i < atom->nlocal; i++) {
            spread(least, most, Vec(atom->x[i]));
            largest = std::max(largest, atom->radius[i]);
        }
        for (int e : loose) {
            Range range = {0, 0, 0, elements_[e].depth, e};
            Vec low(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = -1.0 * low;
            for (int n : elements_[e].node) {
                spread(low, high, position(n, t));
                range.travel = std::max(range.travel, (length_ - t) * std::sqrt(dot(v_[n], v_[n])));
            }
            const double room = range.travel + elements_[e].disc, reach = std::max(largest, range.depth) + room;
            if (apart(low, high, least, most, reach + neighbor->skin)) continue;
            range.low = low.*axis - room, range.high = high.*axis + room;
            widest = std::max(widest, range.high - range.low);
            deepest = std::max(deepest, range.depth);
            ranges.push_back(range);
        }
        std::sort(ranges.begin(), ranges.end(), [](const Range &a, const Range &b) { return a.low < b.low; });
        near_.resize(atom->nlocal);
        for (int i = 0; i < atom->nlocal; i++) {
            const Vec p(atom->x[i]);
            const double most = std::max(atom->radius[i], deepest) + neighbor->skin;
            auto low = [](const Range &range, double value) { return range.low < value; };
            auto range = std::lower_bound(ranges.begin(), ranges.end(), p.*axis - most - widest, low);
            near_[i].clear();
            for (; range != ranges.end() && range->low <= p.*axis + most; ++range) {
                const double reach = std::max(atom->radius[i], range->depth) + neighbor->skin;
                if (range->high >= p.*axis - reach && nearest(range->element, p, t).distance <= reach + range->travel)
                    near_[i].push_back(range->element);
            }
            list_still(i, p);
            std::sort(near_[i].begin(), near_[i].end());
            near_[i].erase(std::unique(near_[i].begin(), near_[i].end()), near_[i].end());
        }
        for (size_t m = 0; m < moving_.size(); m++) x_listed_[m] = position(moving_[m], length_);
        stale_ = false;
    }

    void list_still(int i, const Vec &p)  // elements in squares
    {
        const double skin = neighbor->skin, most = std::max(atom->radius[i], squares_.depth) + squares_.disc + skin;
        squares_.each_near(p, most, [&](int e) {
            if (nearest(e, p, 0.0).distance <= std::max(atom->radius[i], elements_[e].depth) + skin)
                near_[i].push_back(e);
        });
    }

    static void spread(Vec &low, Vec &high, const Vec &p)
    {
        for (double Vec::*axis : {&Vec::x, &Vec::y, &Vec::z}) {
            low.*axis = std::min(low.*axis, p.*axis);
            high.*axis = std::max(high.*axis, p.*axis);
        }
    }

    static bool apart(const Vec &low, const Vec &high, const Vec &least, const Vec &most, double room)
    {
        for (double Vec::*axis : {&Vec::x, &Vec::y, &Vec::z})
            if (low.*axis > most.*axis + room || high.*axis < least.*axis - room) return true;
        return false;
    }

    double Vec::*longest_axis(const std::vector<int> &elements) const
    {
        Vec low(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = -1.0 * low;
        for (int e : elements)
            for (int n : elements_[e].node) spread(low, high, x_[n]);
        double Vec::*longest = &Vec::x;
        for (double Vec::*axis : {&Vec::y, &Vec::z})
            if (high.*axis - low.*axis > high.*longest - low.*longest) longest = axis;
        return longest;
    }

    void post_force_primitive(int) override
    {
        const double t = step_ * update->dt;
        if (stale_) list_near_elements(t);
        kick_nodes();
        forget(force_, loaded_);
        for (int i = 0; i < atom->nlocal; i++) {
            find_contacts(i, t);
            if (springs_) update_springs(i, t);
            for (size_t c = 0; c < contacts_.size(); c++) apply(i, int(c));
        }
        book(x_.size() + 1, Bodies(lmp).mass_times_place());
        std::sort(loaded_.begin(), loaded_.end());
        loaded_.erase(std::unique(loaded_.begin(), loaded_.end()), loaded_.end());
        kick_nodes();
    }

    void find_contacts(int i, double t)  // wall by wall
    {
        const double radius = atom->radius[i];
        int walls = 0;  // touched ones that are no discs
        contacts_.clear();
        for (size_t k = 0; k < near_[i].size();) {
            const Element wall = elements_[near_[i][k]];
            found_.clear();
            for (; k < near_[i].size() && elements_[near_[i][k]].group == wall.group; k++) {
                const Contact c = nearest(near_[i][k], Vec(atom->x[i]), t, radius);
                if (c.distance <= std::max(radius, wall.depth)) found_.push_back(c);
            }
            auto on = [&](const Contact &c, int element) { return holds(element, c, radius, t); };
            if (found_.size() > 1 && !wall.disc) drop_shared(found_, radius, on);
            if (wall.depth >= 0) keep_outward(found_, radius, wall.depth);
            else if (found_.size() > 1 && !wall.disc) keep_distinct(found_, radius);
            if (!wall.disc && !found_.empty()) walls++;
            contacts_.insert(contacts_.end(), found_.begin(), found_.end());
        }
        if (walls > 1) keep_one_at_seams(i, t);
        share_force(contacts_);
    }

    // Whether the element ``other`` holds the point of the contact c.
    bool holds(int other, const Contact &c, double radius, double t) const
    {
        const double tolerance = joined * (radius - c.distance);
        for (int a = 0; a < corners_; a++) {
            bool shared = c.weight[a] == 0;
            for (int b = 0; b < corners_; b++) shared = shared || one_place(other, b, c.element, a, tolerance, t);
            if (!shared) return false;
        }
        return true;
    }

    bool one_place(int e, int a, int f, int b, double tolerance, double t) const
    {
        const int i = elements_[e].node[a], j = elements_[f].node[b];
        if (i == j || elements_[e].joint[a] != elements_[f].joint[b]) return i == j;
        const Vec away = position(i, t) - position(j, t);
        return dot(away, away) <= tolerance * tolerance;
    }

    // One contact where walls meet, the rules of wall_contacts.py.
    void keep_one_at_seams(int i, double t)
    {
        const double radius = atom->radius[i];
        for (Contact &c : contacts_) c.dropped = goes_on(c, i, t);
        for (const Contact &g : contacts_)
            for (Contact &c : contacts_)
                if (g.dropped && c.follows == g.element) c.follows = -1;  // it has lost the one that it followed
        for (const Contact &g : contacts_)
            for (Contact &c : contacts_) {
                if (!one_seam(g, c, radius)) continue;
                for (Contact &o : contacts_)
                    if (o.follows == c.element) o.follows = g.element;
                follow(g, c, contacts_, radius);
            }
        erase_dropped(contacts_);
    }

    // Whether the point of a contact lies on an element of another wall that comes nearer.
    bool goes_on(const Contact &c, int i, double t) const
    {
        const Vec p(atom->x[i]);
        const double radius = atom->radius[i], r = std::fabs(c.distance);
        const Element &mine = elements_[c.element];
        for (int e : near_[i]) {
            const Element &other = elements_[e];
            if (other.group == mine.group || other.disc > 0 || mine.disc > 0) continue;
            const Vec node[3] = {position(other.node[0], t), position(other.node[1], t), position(other.node[2], t)};
            const Contact near = closest(node, p);
            const bool level = std::fabs(near.distance - r) <= 1e-12 * radius;
            const bool first = near.feature < c.feature || (near.feature == c.feature && other.group < mine.group);
            if (near.distance > r + 1e-12 * radius || (level && !first)) continue;
            double angle;
            if (other.depth >= 0 && dot(outward(node, corners_, near.weight, angle), near.offset) > 0)
                continue;  // it faces the other way
            if (closest(node, p + c.offset).distance <= joined * (radius - r) + 1e-12 * radius) return true;
        }
        return false;
    }

    bool one_seam(const Contact &g, const Contact &c, double radius) const
    {
        const Element &a = elements_[g.element], &b = elements_[c.element];
        return !g.dropped && !c.dropped && g.follows < 0 && c.follows < 0 && a.group != b.group && !(a.disc > 0) &&
               !(b.disc > 0) && before(g, c, radius) && g.distance > 0 && same_direction(g, c) &&
               c.distance - g.distance <= (1 - coplanar) * radius;
    }

    void book(size_t row, const Vec &value)
    {
        force_[row] = force_[row] + value;
        loaded_.push_back(int(row));
    }

    void book_moment(const Vec &moment) { book(x_.size(), corners_ == 2 ? Vec(moment.z, 0, 0) : moment); }

    void kick_nodes()  // half a step, as velocity Verlet does with the particles before and after the force changes
    {
        if (update->setupflag) return;
        for (int n : loaded_) {
            impulse_[n] = impulse_[n] + 0.5 * update->dt * force_[n];
            if (!is_hit_[n]) hit_.push_back(n);
            is_hit_[n] = 1;
        }
    }

    double *spring(int i, int contact) const { return springs_->array_atom[i] + contact * (1 + dnum_); }

    // One spring per contact. A new contact takes the spring of the nearest one that has just ended close to it, on
    // whatever element or wall, or with which it shares the force: the sphere went across an edge or a seam (LIGGGHTS
    // turns the spring into the new tangent plane). Discs are contacts of their own.
    void update_springs(int i, double t)
    {
        const int width = 1 + dnum_, count = int(contacts_.size());
        if (!count && spring(i, 0)[0] == 0) return;
        if (count > SLOTS) error->one(FLERR, "a particle touches the wall at more than 32 places");
        std::copy_n(spring(i, 0), SLOTS * width, old_springs_.begin());
        std::fill_n(spring(i, 0), SLOTS * width, 0.0);
        for (int c = 0; c < count; c++) {
            const double *from = spring_for(i, contacts_[c], t);
            if (from) std::copy_n(from, width, spring(i, c));
            spring(i, c)[0] = contacts_[c].element + 1;
        }
    }

    const double *spring_for(int i, const Contact &c, double t) const
    {
        const double *from = nullptr;
        const double close = CLOSE * atom->radius[i];
        double nearest2 = close * close;
        for (const double *old = old_springs_.data(); old != old_springs_.data() + old_springs_.size() && old[0] > 0;
             old += 1 + dnum_)
            if (int(old[0]) - 1 == c.element) return old;
        for (const double *old = old_springs_.data(); old != old_springs_.data() + old_springs_.size() && old[0] > 0;
             old += 1 + dnum_) {
            const int element = int(old[0]) - 1;
            if (elements_[element].disc > 0 || elements_[c.element].disc > 0) continue;
            if (c.share == 1 && touched(element)) continue;
            const Vec away = c.offset - nearest(element, Vec(atom->x[i]), t).offset;
            if (dot(away, away) > nearest2) continue;
            nearest2 = dot(away, away);
            from = old;
        }
        return from;
    }

    bool touched(int element) const
    {
        auto same = [element](const Contact &c) { return c.element == element; };
        return std::any_of(contacts_.begin(), contacts_.end(), same);
    }

    std::string through_the_wall(int i) const  // what checks.py says
    {
        return "sphere " + std::to_string(atom->tag[i]) + " is going through the wall: Hertz's law does not stop it before its "
               "centre is there; take a stiffer contact (E), a smaller speed, more substeps, or a wall with a depth, which "
               "pushes outwards on both sides";
    }

    // The library's own contact model; what it adds to the particle's force goes to the nodes with the opposite sign.
    void apply(int i, int contact)
    {
        const Contact &c = contacts_[contact];
        const int *n = elements_[c.element].node;
        atom_type_wall_ = elements_[c.element].type;
        const double radius = atom->radius[i], disc = elements_[c.element].disc;
        LCM::SurfacesIntersectData data;
        data.is_wall = true;
        data.i = i;
        data.radi = disc > 0 ? radius * disc / (radius + disc) : radius;
        data.deltan = radius - c.nearest;
        data.contact_history = springs_ ? spring(i, contact) + 1 : nullptr;
        // LIGGGHTS takes radi - deltan for the distance, which with a disc is put into delta, and radi - deltan / 2 for the
        // arm of the tangential force: the arm of law.py goes into spin and torque.
        (((data.deltan - data.radi) / c.distance) * c.offset).copy_to(data.delta);
        const double middle = data.radi - 0.5 * data.deltan;
        const double arm = middle == 0 ? 0 : (disc > 0 ? radius - 0.5 * data.deltan : c.distance) / middle;
        const Vec spin(atom->omega[i]), torque(atom->torque[i]);
        (arm * spin).copy_to(atom->omega[i]);
        Vec().copy_to(atom->torque[i]);
        double v_wall[3];
        (c.weight[0] * v_[n[0]] + c.weight[1] * v_[n[1]] + c.weight[2] * v_[n[2]]).copy_to(v_wall);
        const Vec others(atom->f[i]);
        Vec().copy_to(atom->f[i]);
        impl->compute_force(this, data, true, v_wall);
        Vec force(atom->f[i]);
        if (c.distance < THROUGH * radius && elements_[c.element].depth < 0 && !(disc > 0)) {
            const double closing = std::max(dot(Vec(atom->v[i]) - Vec(v_wall), c.offset) / c.distance, 0.0);
            if (0.5 * atom->rmass[i] * closing * closing > -dot(force, c.offset))
                error->one(FLERR, through_the_wall(i).c_str());
        }
        force = c.share * force;
        (others + force).copy_to(atom->f[i]);
        (torque + c.share * arm * Vec(atom->torque[i])).copy_to(atom->torque[i]);
        spin.copy_to(atom->omega[i]);
        const Vec lever = ((disc > 0 ? radius - 0.5 * data.deltan : c.distance) / c.distance) * c.offset;
        book_moment(cross(Vec(atom->x[i]) + lever, force));
        for (int j = 0; j < corners_; j++) {
            force_[n[j]] = force_[n[j]] - c.weight[j] * force;
            loaded_.push_back(n[j]);
        }
        if (rolling_) roll(i, contact, data);
    }

    // Rolling friction as in rolling.py: a torque on the particle, and the opposite one on the nodes as forces.
    void roll(int i, int contact, const LCM::SurfacesIntersectData &data)
    {
        const Contact &c = contacts_[contact];
        const Element &e = elements_[c.element];
        const double t = step_ * update->dt;
        const Vec node[3] = {position(e.node[0], t), position(e.node[1], t), position(e.node[2], t)};
        const Levers levers = levers_of(node, corners_, e.disc > 0);
        Vec turn(atom->omega[i]);
        for (int a = 0; a < corners_; a++) turn = turn - dot(levers.area, v_[e.node[a]]) * levers.lever[a];
        double relative[3], torque[3];
        turn.copy_to(relative);
        LCM::rolling_torque(data, data.radi, rolling_[data.itype][data.jtype], update->dt, relative,
                            spring(i, contact) + 1 + dnum_ - 3, torque);
        const Vec couple = c.share * Vec(torque);
        (Vec(atom->torque[i]) + couple).copy_to(atom->torque[i]);
        book_moment(couple);
        for (int a = 0; a < corners_; a++)
            force_[e.node[a]] = force_[e.node[a]] - dot(levers.lever[a], couple) * levers.area;
    }
};
