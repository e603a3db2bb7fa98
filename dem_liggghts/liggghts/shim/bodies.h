// Rigid bodies of spheres: LIGGGHTS' own fix multisphere, filled and read directly, so that mass, inertia, place and
// orientation are exact and a state is complete.
#pragma once
#include <cmath>
#include <stdexcept>
#include <vector>

#include "atom.h"
#include "domain.h"
#include "fix_multisphere.h"
#include "geometry.h"
#include "group.h"
#include "modify.h"
#include "multisphere.h"

using namespace LAMMPS_NS;

// A body as numbers. What never changes: tag, mass, number of spheres, principal moments of inertia (3), free to move
// along and turn about the axes of space (6), radius of a sphere about its spheres and the way there from the centre
// of mass along the principal axes (3); then x (3), v (3), omega (3), angular momentum (3), quaternion of the
// principal axes (4), force (3), torque (3).
enum { TAG, MASS, SPHERES, INERTIA, FREE = 6, BOUND = 12, TO_BOUND, X = 16, V = 19, OMEGA = 22, SPIN = 25, Q = 28,
       FORCE = 32, TORQUE = 35, BODY_WIDTH = 38 };

class Bodies {
public:
    explicit Bodies(LAMMPS *lmp)
        : lmp_(lmp), fix_(static_cast<FixMultisphere *>(lmp->modify->find_fix_style("multisphere", 0)))
    {
    }

    bool any() const { return fix_; }
    int count() const { return fix_ ? fix_->n_body() : 0; }

    // The sphere with local number i belongs to the body with this tag, at ``arm`` along its principal axes; -1: to none,
    // which has to be said too, because LIGGGHTS packs its arm with the sphere and never sets it.
    void join(int i, int tag, const double *arm)
    {
        double place[3] = {arm[0], arm[1], arm[2]};
        fix_->set_body_displace(i, place, tag, 1.0);
    }

    // Replace all bodies by these n, each on the rank that holds the middle of its spheres.
    void place(int n, const double *data)
    {
        Multisphere &all = fix_->data();
        fix_->just_created = 0;           // else the set-up takes the spheres out of their bodies
        fix_->set_add_dragforce(false);  // a force that is not sent along with its body to another rank
        while (all.n_body() > 0) all.remove_body(all.n_body() - 1);
        for (const double *b = data; b != data + n * BODY_WIDTH; b += BODY_WIDTH) add(b);
        all.calc_nbody_all();
        if (all.n_body_all() != n) throw std::runtime_error("a body lies outside the box");
        all.generate_map();
        all.reset_forces(true);
        set_forces(n, data);
    }

    void set_forces(int n, const double *data)
    {
        for (const double *b = data; b != data + n * BODY_WIDTH; b += BODY_WIDTH) {
            const int i = fix_->data().map(int(b[TAG]));
            if (i < 0) continue;
            vector("fcm").set(i, copy(b + FORCE));
            vector("torque").set(i, copy(b + TORQUE));
        }
    }

    // From those on their spheres and gravity: in a set-up the fix does so before the walls have added theirs.
    void sum_forces()
    {
        fix_->data().reset_forces(true);
        fix_->comm_correct_force(true);
        fix_->calc_force(true);
    }

    void halt()
    {
        for (int i = 0; i < count(); i++)
            for (const char *name : {"vcm", "omega", "angmom"}) std::fill_n(vector(name).begin()[i], 3, 0.0);
    }

    // Sum over this rank's single spheres and bodies.
    Vec mass_times_place()
    {
        const Atom *atom = lmp_->atom;
        const int single = lmp_->group->find("single");
        Vec sum;
        for (int i = 0; i < atom->nlocal; i++)
            if (!fix_ || (single >= 0 && (atom->mask[i] & lmp_->group->bitmask[single])))
                sum = sum + atom->rmass[i] * Vec(atom->x[i]);
        for (int i = 0; i < count(); i++)
            sum = sum + fix_->data().mass(i) * Vec(vector("xcm").begin()[i]);
        return sum;
    }

    // tag, then what changes, of each body of this rank: 1 + BODY_WIDTH - X numbers each.
    void read(double *out)
    {
        for (int i = 0; i < count(); i++) {
            *out++ = fix_->data().tag(i);
            for (const char *name : {"xcm", "vcm", "omega", "angmom"})
                out = std::copy_n(vector(name).begin()[i], 3, out);
            fix_->data().quat(out, i);
            out += 4;
            for (const char *name : {"fcm", "torque"}) out = std::copy_n(vector(name).begin()[i], 3, out);
        }
    }

private:
    LAMMPS *lmp_;
    FixMultisphere *fix_;
    double room_[4];

    VectorContainer<double, 3> &vector(const char *name)
    {
        return *fix_->data().prop().getElementProperty<VectorContainer<double, 3>>(name);
    }

    double *copy(const double *from)  // LIGGGHTS wants pointers to what may change
    {
        std::copy_n(from, 4, room_);
        return room_;
    }

    void add(const double *b)
    {
        std::vector<double> own(b, b + BODY_WIDTH);  // LIGGGHTS wants pointers to what may change
        double axes[3][3], middle[3];
        MathExtra::q_to_exyz(&own[Q], axes[0], axes[1], axes[2]);
        for (int k = 0; k < 3; k++) {
            middle[k] = own[X + k];
            for (int a = 0; a < 3; a++) middle[k] += own[TO_BOUND + a] * axes[a][k];
        }
        if (!lmp_->domain->is_in_subdomain(middle)) return;
        bool along[3], about[3];
        for (int k = 0; k < 3; k++) along[k] = own[FREE + k] != 0, about[k] = own[FREE + 3 + k] != 0;
        Multisphere &all = fix_->data();
        const int i = all.n_body();
        all.add_body(int(own[SPHERES]), &own[X], &own[TO_BOUND], own[BOUND], &own[V], &own[OMEGA], own[MASS], 1.0, 1, 1,
                     &own[INERTIA], axes[0], axes[1], axes[2], nullptr, along, about);
        all.prop().getElementProperty<ScalarContainer<int>>("id_multisphere")->set(i, int(own[TAG]));
        all.prop().getElementProperty<VectorContainer<double, 4>>("quat")->set(i, &own[Q]);
        vector("angmom").set(i, &own[SPIN]);
    }
};
