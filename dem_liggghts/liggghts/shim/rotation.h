// The fix multisphere/splitting: LIGGGHTS' fix multisphere with another rotation of the free body in a step.
//
// LIGGGHTS turns the quaternion by Richardson's extrapolation, which loses energy step by step (of third order in the
// step, and always in the same direction). Here it is turned by exact rotations, see rigid.py, whose order of operations
// this is.
#pragma once
#include <algorithm>
#include <cmath>

#include "atom.h"
#include "fix_multisphere.h"
#include "math_extra.h"

using namespace LAMMPS_NS;

class FixMultisphereSplitting : public FixMultisphere {
public:
    FixMultisphereSplitting(LAMMPS *lmp, int argc, char **argv) : FixMultisphere(lmp, argc, argv)
    {
        x_ = vectors("xcm"), v_ = vectors("vcm"), omega_ = vectors("omega"), spin_ = vectors("angmom");
        force_ = vectors("fcm"), torque_ = vectors("torque"), inertia_ = vectors("inertia");
        ex_ = vectors("ex_space"), ey_ = vectors("ey_space"), ez_ = vectors("ez_space");
        q_ = data().prop().getElementProperty<VectorContainer<double, 4>>("quat");
        mass_ = data().prop().getElementProperty<ScalarContainer<double>>("masstotal");
        along_ = data().prop().getElementProperty<VectorContainer<bool, 3>>("fflag");
        about_ = data().prop().getElementProperty<VectorContainer<bool, 3>>("tflag");
    }

    static Fix *create(LAMMPS *lmp, int argc, char **argv) { return new FixMultisphereSplitting(lmp, argc, argv); }

    void initial_integrate(int vflag) override  // as LIGGGHTS' own but for ``turn``
    {
        for (int b = 0; b < n_body(); b++) {
            double *x = x_->begin()[b], *v = v_->begin()[b], *spin = spin_->begin()[b];
            for (int k = 0; k < 3; k++) {
                if (along_->begin()[b][k]) v[k] += dtf / mass_->begin()[b] * force_->begin()[b][k];
                x[k] += dtv * v[k];
                if (about_->begin()[b][k]) spin[k] += dtf * torque_->begin()[b][k];
            }
            turn(b);
        }
        if (vflag) v_setup(vflag);
        else evflag = 0;
        set_xv();
        rev_comm_flag_ = MS_COMM_REV_X_V_OMEGA;
        reverse_comm();
    }

private:
    using Vectors = VectorContainer<double, 3>;
    Vectors *x_, *v_, *omega_, *spin_, *force_, *torque_, *inertia_, *ex_, *ey_, *ez_;
    VectorContainer<double, 4> *q_;
    ScalarContainer<double> *mass_;
    VectorContainer<bool, 3> *along_, *about_;

    Vectors *vectors(const char *name) { return data().prop().getElementProperty<Vectors>(name); }

    void turn(int b)  // rigid.rotate
    {
        double *axes[3] = {ex_->begin()[b], ey_->begin()[b], ez_->begin()[b]};
        double *q = q_->begin()[b], *spin = spin_->begin()[b], *inertia = inertia_->begin()[b], own[3];
        for (int k = 0; k < 3; k++) own[k] = MathExtra::dot3(spin, axes[k]);
        const int a = middle(inertia), i = (a + 1) % 3, j = (a + 2) % 3;
        const double whole = 0.5 * dtv / inertia[a], about_i = 0.5 * dtv / inertia[i] - whole,
                     about_j = 0.5 * dtv / inertia[j] - whole;
        turn_about_spin(q, spin, whole);
        turn_about_axis(q, own, j, about_j);
        turn_about_axis(q, own, i, about_i);
        MathExtra::q_to_exyz(q, axes[0], axes[1], axes[2]);
        MathExtra::angmom_to_omega(spin, axes[0], axes[1], axes[2], inertia, omega_->begin()[b]);
        turn_about_axis(q, own, i, about_i);
        turn_about_axis(q, own, j, about_j);
        turn_about_spin(q, spin, whole);
        MathExtra::qnormalize(q);
        MathExtra::q_to_exyz(q, axes[0], axes[1], axes[2]);
    }

    static int middle(const double *inertia)
    {
        for (int a = 0; a < 2; a++)
            if ((inertia[a] - inertia[(a + 1) % 3]) * (inertia[a] - inertia[(a + 2) % 3]) <= 0) return a;
        return 2;
    }

    static void turn_about_spin(double *q, const double *spin, double factor)
    {
        const double size = MathExtra::len3(spin);
        if (!(size > 0)) return;
        const double half = 0.5 * factor * size, c = std::cos(half), s = std::sin(half) / size;
        const double b = s * spin[0], d = s * spin[1], e = s * spin[2], w = q[0], x = q[1], y = q[2], z = q[3];
        q[0] = c * w - b * x - d * y - e * z;
        q[1] = c * x + b * w + d * z - e * y;
        q[2] = c * y - b * z + d * w + e * x;
        q[3] = c * z + b * y - d * x + e * w;
    }

    static void turn_about_axis(double *q, double *own, int k, double factor)
    {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double half = 0.5 * factor * own[k], c = std::cos(half), s = std::sin(half);
        const double w = q[0], qi = q[1 + i], qj = q[1 + j], qk = q[1 + k];
        q[0] = w * c - qk * s, q[1 + k] = qk * c + w * s, q[1 + i] = qi * c + qj * s, q[1 + j] = qj * c - qi * s;
        const double cosine = c * c - s * s, sine = 2 * c * s, along = own[i];
        own[i] = cosine * along + sine * own[j];
        own[j] = cosine * own[j] - sine * along;
    }
};
