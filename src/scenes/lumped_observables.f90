!! What `&record` asks for in a lumped scene, as observables of the machine.
module razy_scenes_lumped_observables
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: did_you_mean, lower, string_t
   use razy_machine_machine, only: machine_t, observable_t, observe_contact_force, observe_linear
   use razy_scenes_lumped_bodies, only: bodies_t
   implicit none(type, external)
   private

   public :: new_observable

contains

   !> The observable of `&record` number i; none for `observable = 'state'`.
   subroutine new_observable(observable, machine, bodies, input, i, error)
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: what
      integer :: body, contact, n

      call input%get("record", i, "observable", what)
      observable%name = lower(what)
      n = bodies%count
      allocate (observable%on_displacement(n), observable%on_velocity(n), source=0.0_wp)
      allocate (observable%error(size(machine%tone)), source=(0.0_wp, 0.0_wp))
      select case (observable%name)
      case ("mesh_deformation", "relative_displacement", "contact_force")
         call choose_contact(machine, input, i, observable%name, contact, error)
         if (allocated(error)) return
         observable%kind = merge(observe_contact_force, observe_linear, observable%name == "contact_force")
         observable%contact = contact
         observable%on_displacement = machine%contact(contact)%w
         observable%constant = machine%contact(contact)%offset
         observable%error = machine%contact(contact)%error
         observable%unit = machine%contact(contact)%unit
         if (observable%name == "contact_force") observable%unit = machine%contact(contact)%force_unit
         observable%long_name = machine%contact(contact)%name//long_name(observable%name)
      case default
         call choose_body(bodies, input, i, body, error)
         if (allocated(error)) return
         if (observable%name == "displacement") observable%on_displacement(body) = 1.0_wp
         if (observable%name == "velocity") observable%on_velocity(body) = 1.0_wp
         observable%unit = trim(merge(machine%unit(body), machine%rate_unit(body), observable%name == "displacement"))
         observable%long_name = observable%name//" of "//bodies%name(body)%text
      end select
      if (input%given("record", i, "of")) observable%name = observable%name//"."//name_of(input, i)
   end subroutine new_observable

   pure function long_name(name)
      character(*), intent(in) :: name
      character(:), allocatable :: long_name

      select case (name)
      case ("mesh_deformation")
         long_name = " deformation"
      case ("contact_force")
         long_name = " contact force"
      case default
         long_name = " relative displacement"
      end select
   end function long_name

   function name_of(input, i) result(name)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(:), allocatable :: name

      call input%get("record", i, "of", name)
   end function name_of

   !> The contact that a record belongs to: the one it names, or the only one.
   subroutine choose_contact(machine, input, i, what, contact, error)
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: what
      integer, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)
      integer :: first, last, meshes

      meshes = input%count("gear_mesh")
      first = merge(meshes + 1, 1, what == "relative_displacement")
      last = merge(meshes, size(machine%contact), what == "mesh_deformation")
      allocate (known(max(0, last - first + 1)))
      do contact = first, last
         known(contact - first + 1)%text = machine%contact(contact)%name
      end do
      if (size(known) == 0) then
         contact = 0
         call input%complain(error, "record", i, "observable", "this needs a contact, and the scene has none of its kind")
         return
      end if
      call pick(input, i, known, "contacts", contact, error)
      contact = first - 1 + contact
   end subroutine choose_contact

   subroutine choose_body(bodies, input, i, body, error)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      integer, intent(out) :: body
      type(error_t), allocatable, intent(out) :: error

      call pick(input, i, bodies%name, "bodies", body, error)
   end subroutine choose_body

   !> The place in `known` of the name in `of`; without a name the only one there is.
   subroutine pick(input, i, known, things, place, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(string_t), intent(in) :: known(:)
      character(*), intent(in) :: things
      integer, intent(out) :: place
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name

      place = 1
      if (.not. input%given("record", i, "of")) then
         if (size(known) > 1) call input%complain(error, "record", i, "of", &
                                                  "required where there are several; "//did_you_mean("", known, things))
         return
      end if
      name = name_of(input, i)
      do place = 1, size(known)
         if (lower(known(place)%text) == lower(name)) return
      end do
      call input%complain(error, "record", i, "of", did_you_mean(name, known, things))
   end subroutine pick

end module razy_scenes_lumped_observables
