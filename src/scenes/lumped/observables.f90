!! What `&record` asks for in a lumped scene, as observables of the machine.
module razy_scenes_lumped_observables
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: machine_t, observable_t
   use razy_scenes_lumped_bodies, only: bodies_t
   use razy_scenes_observables, only: begin_observable, name_observable, observe_contacts, pick
   implicit none(type, external)
   private

   public :: lumped_observable

contains

   !> The observable of `&record` number i; none for `observable = 'state'`.
   subroutine lumped_observable(observable, machine, bodies, input, i, error)
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      integer :: body
      logical :: taken

      call begin_observable(observable, machine, input, i)
      call observe_contacts(observable, machine, input, i, input%count("gear_mesh"), input%count("stop"), taken, error)
      if (.not. taken) then
         call pick(input, i, bodies%name, "bodies", body, error)
         if (allocated(error)) return
         if (observable%name == "displacement") observable%on_displacement(body) = 1.0_wp
         if (observable%name == "velocity") observable%on_velocity(body) = 1.0_wp
         observable%unit = trim(merge(machine%unit(body), machine%rate_unit(body), observable%name == "displacement"))
         observable%long_name = observable%name//" of "//bodies%name(body)%text
      end if
      if (.not. allocated(error)) call name_observable(observable, input, i)
   end subroutine lumped_observable

end module razy_scenes_lumped_observables
