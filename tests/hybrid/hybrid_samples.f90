!! Hybrid systems made by hand, in a state and a mode, for tests of the modules of src/hybrid.
module hybrid_samples
   use machine_samples, only: add_contact, bare_machine, start_at
   use razy_contact_friction_law, only: new_friction_law
   use razy_contact_rigid_law, only: new_rigid_law, rigid_side_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_system, only: system_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: ball_on_floor, block_on_floor, in_mode, state_of, system_of

contains

   !> The system of a machine, all coordinates kept.
   function system_of(machine) result(system)
      type(machine_t), intent(in) :: machine
      type(system_t) :: system

      type(error_t), allocatable :: error

      call system%take(machine, .true., .false., error)
      if (allocated(error)) error stop "the machine was refused"
   end function system_of

   !> z at these displacements and velocities.
   pure function state_of(system, displacement, velocity) result(z)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: displacement(:), velocity(:)
      real(wp) :: z(2*system%m)

      z = [matmul(system%coupled%to_coupled, displacement), matmul(system%coupled%to_coupled, velocity)]
   end function state_of

   !> The dynamics in the mode of these branches, at the time 0.
   function in_mode(system, branch) result(dynamics)
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:)
      type(dynamics_t) :: dynamics

      call dynamics%make_room(system, 0.0_wp)
      dynamics%mode%branch = branch
      call dynamics%mode%enter(system)
      call dynamics%excitation%begin(system%machine%tone, 0.0_wp, 0.0_wp)
   end function in_mode

   !> A ball over a rigid floor at 0.
   function ball_on_floor(mass, gravity, restitution) result(machine)
      real(wp), intent(in) :: mass, gravity, restitution
      type(machine_t) :: machine

      machine = bare_machine([mass])
      machine%load = -mass*gravity
      call add_contact(machine, [1.0_wp], new_rigid_law(rigid_side_t(.true., 0.0_wp), rigid_side_t(.false.), restitution))
      call start_at(machine, [1.0_wp], [0.0_wp])
   end function ball_on_floor

   !> A block over a rigid floor (contact 1), pulled along it with the force `pull` against Coulomb friction (contact 2).
   function block_on_floor(mass, gravity, pull, static, kinetic, restitution) result(machine)
      real(wp), intent(in) :: mass, gravity, pull, static, kinetic, restitution
      type(machine_t) :: machine

      machine = bare_machine([mass, mass])
      machine%load = [pull, -mass*gravity]
      call add_contact(machine, [0.0_wp, 1.0_wp], new_rigid_law(rigid_side_t(.true., 0.0_wp), rigid_side_t(.false.), restitution))
      call add_contact(machine, [1.0_wp, 0.0_wp], new_friction_law(static, kinetic, 0.0_wp))
      machine%contact(2)%normal_of = 1
      call start_at(machine, [0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp])
   end function block_on_floor

end module hybrid_samples
