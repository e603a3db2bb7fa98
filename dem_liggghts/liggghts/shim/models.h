// The contact law of contact/law.py where it differs from LIGGGHTS': two contact models that stand on LIGGGHTS' own,
// one for rolling friction, and what it takes to make them known to it, as `model hertz/damped`, `tangential coulomb` and
// `rolling_friction coulomb`.
#pragma once
#include <algorithm>
#include <cmath>

#include "fix_insert_stream.h"  // which granular_styles.h needs and does not include
#include "global_properties.h"
#include "granular_styles.h"

namespace LIGGGHTS {
namespace ContactModels {

static const int HERTZ_DAMPED = 60, TANGENTIAL_COULOMB = 60, ROLLING_COULOMB = 60;  // numbers of models, below 64; LIGGGHTS' are small

inline MatrixProperty *minus_damping_ratio(PropertyRegistry &registry, const char *caller, bool)
{
    MatrixProperty *table = MODEL_PARAMS::createPerTypePairProperty(registry, "dampingRatio", caller);
    for (int i = 0; i < table->rows; i++)
        for (int j = 0; j < table->cols; j++) table->data[i][j] *= -1;
    return table;
}

inline MatrixProperty *attraction(PropertyRegistry &registry, const char *caller, bool)
{
    return MODEL_PARAMS::createPerTypePairProperty(registry, "attraction", caller);
}

// Hertz's law whose damping ratio is given instead of computed from the restitution, and whose force is zero where the
// damper would pull, unless the two materials have attraction.
template <> class NormalModel<HERTZ_DAMPED> : public NormalModel<HERTZ> {
public:
    NormalModel(LAMMPS *lmp, IContactHistorySetup *history, ContactModelBase *model)
        : NormalModel<HERTZ>(lmp, history, model)
    {
    }

    void connectToProperties(PropertyRegistry &registry)
    {
        const char *caller = "model hertz/damped";
        registry.registerProperty("Yeff", &MODEL_PARAMS::createYeff);
        registry.registerProperty("Geff", &MODEL_PARAMS::createGeff);
        registry.registerProperty("betaeff", &minus_damping_ratio);
        registry.registerProperty("attraction", &attraction);
        registry.connect("Yeff", Yeff, caller);
        registry.connect("Geff", Geff, caller);
        registry.connect("betaeff", betaeff, caller);
        registry.connect("attraction", attraction_, caller);
    }

    void surfacesIntersect(SurfacesIntersectData &contact, ForceData &on_i, ForceData &on_j)
    {
        NormalModel<HERTZ>::surfacesIntersect(contact, on_i, on_j);
        if (!(contact.Fn < 0) || attraction_[contact.itype][contact.jtype] != 0) return;  // NaN goes on
        on_i.reset();  // the normal model comes first: nothing else is in there
        on_j.reset();
        contact.Fn = 0;
    }

private:
    double **attraction_ = nullptr;
};

// LIGGGHTS' spring with history, with Coulomb's limit on spring and damper together.
template <> class TangentialModel<TANGENTIAL_COULOMB> : public TangentialModel<TANGENTIAL_HISTORY> {
public:
    TangentialModel(LAMMPS *lmp, IContactHistorySetup *history, ContactModelBase *model)
        : TangentialModel<TANGENTIAL_HISTORY>(lmp, history, model)
    {
    }

    void connectToProperties(PropertyRegistry &registry)
    {
        TangentialModel<TANGENTIAL_HISTORY>::connectToProperties(registry);
        registry.connect("coeffFrict", friction_, "tangential_model coulomb");
    }

    void surfacesIntersect(const SurfacesIntersectData &contact, ForceData &on_i, ForceData &on_j)
    {
        ForceData i, j;
        SurfacesIntersectData pushed = contact;  // LIGGGHTS takes the size of a pull for a normal force
        pushed.Fn = std::max(contact.Fn, 0.0);
        TangentialModel<TANGENTIAL_HISTORY>::surfacesIntersect(pushed, i, j);
        const double limit = friction_[contact.itype][contact.jtype] * pushed.Fn, size = vectorMag3D(i.delta_F);
        const double share = size > limit ? limit / size : 1.0;
        for (int k = 0; k < 3; k++) {
            on_i.delta_F[k] += share * i.delta_F[k];
            on_j.delta_F[k] += share * j.delta_F[k];
            on_i.delta_torque[k] += share * i.delta_torque[k];
            on_j.delta_torque[k] += share * j.delta_torque[k];
        }
    }

private:
    double **friction_ = nullptr;
};

// Torque of rolling friction [N m], of a spring and a damper with a limit: law.py. turn: angular velocity relative to the
// partner; history: displacement of the spring.
inline void rolling_torque(const SurfacesIntersectData &contact, double radius, double friction, double dt,
                           const double *turn, double *history, double *torque)
{
    const bool grows = contact.computeflag && contact.shearupdate;
    const double *n = contact.en, along = vectorDot3D(turn, n), limit = friction * std::max(contact.Fn, 0.0);
    double rate[3], spring[3];
    for (int k = 0; k < 3; k++) {
        rate[k] = radius * (turn[k] - along * n[k]);
        spring[k] = history[k] + (grows ? rate[k] * dt : 0);
    }
    const double normal = vectorDot3D(spring, n);
    for (int k = 0; k < 3; k++) spring[k] -= normal * n[k];
    const double elastic = contact.kt * vectorMag3D(spring);
    const bool slides = elastic > limit;
    for (int k = 0; k < 3; k++) {
        if (slides) spring[k] *= limit / elastic;
        torque[k] = -contact.kt * spring[k] - (slides ? 0 : contact.gammat * rate[k]);
    }
    const double size = vectorMag3D(torque), share = size > limit && !slides ? limit / size : 1.0;
    for (int k = 0; k < 3; k++) torque[k] *= share * radius;
    if (grows) std::copy(spring, spring + 3, history);
}

// Between spheres; at walls it keeps the history alone, and wall.h, which knows how they turn, does the rest.
template <> class RollingModel<ROLLING_COULOMB> : public RollingModelBase {
public:
    RollingModel(LAMMPS *lmp, IContactHistorySetup *history, ContactModelBase *model)
        : RollingModelBase(lmp, history, model)
    {
        first_ = history->add_history_value("rolling_x", "1");
        history->add_history_value("rolling_y", "1");
        history->add_history_value("rolling_z", "1");
    }

    void connectToProperties(PropertyRegistry &registry) override
    {
        registry.registerProperty("coeffRollFrict", &MODEL_PARAMS::createCoeffRollFrict);
        registry.connect("coeffRollFrict", friction_, "rolling_model coulomb");
    }

    void surfacesIntersect(SurfacesIntersectData &contact, ForceData &on_i, ForceData &on_j) override
    {
        if (contact.is_wall) return;
        double turn[3], torque[3];
        vectorSubtract3D(contact.omega_i, contact.omega_j, turn);
        rolling_torque(contact, contact.radi * contact.radj / (contact.radi + contact.radj),
                       friction_[contact.itype][contact.jtype], update->dt, turn, contact.contact_history + first_, torque);
        for (int k = 0; k < 3; k++) {
            on_i.delta_torque[k] += torque[k];
            on_j.delta_torque[k] -= torque[k];
        }
    }

    void surfacesClose(SurfacesCloseData &gap, ForceData &, ForceData &) override
    {
        std::fill_n(gap.contact_history + first_, 3, 0.0);
    }

    void registerSettings(Settings &) override {}
    void postSettings(IContactHistorySetup *, ContactModelBase *) override {}
    void beginPass(SurfacesIntersectData &, ForceData &, ForceData &) override {}
    void endPass(SurfacesIntersectData &, ForceData &, ForceData &) override {}

private:
    double **friction_ = nullptr;
    int first_ = 0;  // of the history values
};

template <class Style> struct Registered {
    static PairStyles::IGranularPairStyle *pair(LAMMPS *lmp, PairGran *parent, int64_t hash)
    {
        return new PairStyles::Granular<ContactModel<Style>>(lmp, parent, hash);
    }
    static Walls::IGranularWall *wall(LAMMPS *lmp, FixWallGran *parent, int64_t hash)
    {
        return new Walls::Granular<ContactModel<Style>>(lmp, parent, hash);
    }
    static void add()
    {
        PairStyles::Factory::instance().addStyle("gran", int(Style::HASHCODE), &pair);
        Walls::Factory::instance().addStyle("gran", int(Style::HASHCODE), &wall);
    }
};

// Once per process: LIGGGHTS keeps its tables from instance to instance.
inline void register_models()
{
    static bool done = false;
    if (done) return;
    done = true;
    Factory::instance().addNormalModel("hertz/damped", HERTZ_DAMPED);
    Factory::instance().addTangentialModel("coulomb", TANGENTIAL_COULOMB);
    Factory::instance().addRollingModel("coulomb", ROLLING_COULOMB);
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_OFF, COHESION_OFF>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_OFF, COHESION_SJKR>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_COULOMB, COHESION_OFF>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_COULOMB, COHESION_SJKR>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_COULOMB, COHESION_OFF, ROLLING_COULOMB>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_COULOMB, COHESION_SJKR, ROLLING_COULOMB>>::add();
}

}  // namespace ContactModels
}  // namespace LIGGGHTS
