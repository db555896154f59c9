!! A mass on a damped spring that is pressed against a stop 1 mm away by a force of 30 N: built here, followed by `exact`, and its
!! turning points printed.
program machine_in_code
   use razy_contact_clearance_law, only: clearance_side_t, new_clearance_law
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_flow, only: flow_t
   use razy_machine_machine, only: add_contact, add_observable, machine_t, plain_machine
   use razy_motion_integrator, only: observer_slot_t, outcome_t
   use razy_motion_method, only: method_t
   use razy_observe_extrema, only: extrema_t
   use razy_study_motion, only: run_motion
   implicit none(type, external)

   type(machine_t) :: machine
   type(extrema_t), target :: extrema
   type(observer_slot_t) :: observers(1)
   class(flow_t), allocatable, target :: integrator
   type(outcome_t) :: outcome
   type(error_t), allocatable :: error
   integer :: i

   machine = plain_machine(mass=reshape([2.0_wp], [1, 1]), damping=reshape([8.0_wp], [1, 1]), &
                           stiffness=reshape([2.0e4_wp], [1, 1]))
   machine%load = [30.0_wp]
   call add_contact(machine, "bumper", [1.0_wp], new_clearance_law(clearance_side_t(), &
                                             clearance_side_t(.true., edge=1.0e-3_wp, stiffness=1.0e6_wp, damping=50.0_wp), .true.))
   call add_observable(machine, "displacement", "m", [1.0_wp], [0.0_wp])
   call extrema%forget()
   observers(1)%observer => extrema
   call run_motion(machine, method_t(integrator="exact"), 0.2_wp, observers, outcome, error, 1000000_i8, .false., integrator)
   if (allocated(error)) error stop error%message
   print "(i0, a, f0.3, a)", outcome%events, " events until ", outcome%time, " s"
   print "(f9.6, a, f9.6, a)", (extrema%time(i), " s ", 1000*extrema%value(i), " mm", i=1, extrema%count)

end program machine_in_code
