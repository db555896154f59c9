!! What `&record` may ask for in every kind of scene: quantities of contacts, and names of what is recorded.
module razy_scenes_observables
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: did_you_mean, lower, string_t
   use razy_machine_machine, only: machine_t, observable_t, observe_contact_force, observe_linear
   implicit none(type, external)
   private

   public :: begin_observable, name_observable, observe_contact, observe_contacts, observe_coordinate, pick

contains

   !> An observable of a machine, called what `&record` number i calls it, that is zero so far.
   subroutine begin_observable(observable, machine, input, i)
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i

      character(:), allocatable :: what
      integer :: n

      call input%get("record", i, "observable", what)
      observable%name = lower(what)
      n = size(machine%load)
      allocate (observable%on_displacement(n), observable%on_velocity(n), source=0.0_wp)
      allocate (observable%error(size(machine%tone)), source=(0.0_wp, 0.0_wp))
   end subroutine begin_observable

   !> The full name: with what it belongs to, where the record says that.
   subroutine name_observable(observable, input, i)
      type(observable_t), intent(inout) :: observable
      type(input_t), intent(in) :: input
      integer, intent(in) :: i

      if (input%given("record", i, "of")) observable%name = observable%name//"."//name_of(input, i)
   end subroutine name_observable

   !> Make it what it is called, if that is a quantity of a contact (`taken`). The contacts of the machine are `meshes` gear meshes,
   !> then `stops` stops, then friction elements.
   subroutine observe_contacts(observable, machine, input, i, meshes, stops, taken, error)
      type(observable_t), intent(inout) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, meshes, stops
      logical, intent(out) :: taken
      type(error_t), allocatable, intent(out) :: error

      taken = .true.
      select case (observable%name)
      case ("mesh_deformation")
         call observe_contact(observable, machine, input, i, 1, meshes, error)
      case ("relative_displacement")
         call observe_contact(observable, machine, input, i, meshes + 1, meshes + stops, error)
      case ("sliding_velocity")
         call observe_contact(observable, machine, input, i, meshes + stops + 1, size(machine%contact), error)
      case ("contact_force")
         call observe_contact(observable, machine, input, i, 1, size(machine%contact), error)
      case default
         taken = .false.
      end select
   end subroutine observe_contacts

   !> Make it the displacement or velocity row·q, an angle if it `turns`, of what the record names.
   subroutine observe_coordinate(observable, row, turns, input, i)
      type(observable_t), intent(inout) :: observable
      real(wp), intent(in) :: row(:)
      logical, intent(in) :: turns
      type(input_t), intent(in) :: input
      integer, intent(in) :: i

      if (observable%name == "displacement") observable%on_displacement = row
      if (observable%name == "velocity") observable%on_velocity = row
      observable%unit = trim(merge("rad", "m  ", turns))
      if (observable%name == "velocity") observable%unit = observable%unit//"/s"
      observable%long_name = observable%name//" of "//name_of(input, i)
   end subroutine observe_coordinate

   !> Make it the force, the variable s or the rate s' of the contact that the record names, one of `first` to `last`.
   subroutine observe_contact(observable, machine, input, i, first, last, error)
      type(observable_t), intent(inout) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, first, last
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)
      integer :: contact

      allocate (known(max(0, last - first + 1)))
      do contact = first, last
         known(contact - first + 1)%text = machine%contact(contact)%name
      end do
      if (size(known) == 0) then
         call input%complain(error, "record", i, "observable", "this needs a contact, and the scene has none of its kind")
         return
      end if
      call pick(input, i, known, "contacts", contact, error)
      if (allocated(error)) return
      observable%contact = first - 1 + contact
      associate (chosen => machine%contact(observable%contact))
         observable%kind = merge(observe_contact_force, observe_linear, observable%name == "contact_force")
         observable%on_displacement = chosen%w
         observable%constant = chosen%offset
         observable%error = chosen%error
         observable%unit = chosen%unit
         if (observable%name == "contact_force") observable%unit = chosen%force_unit
         if (observable%name == "sliding_velocity") then
            observable%on_displacement = 0.0_wp
            observable%on_velocity = chosen%w
            observable%constant = chosen%drive
            observable%error = chosen%error*cmplx(0.0_wp, machine%tone%omega, wp)
            observable%unit = chosen%unit//"/s"
         end if
         observable%long_name = chosen%name//long_name(observable%name)
      end associate
   end subroutine observe_contact

   pure function long_name(name)
      character(*), intent(in) :: name
      character(:), allocatable :: long_name

      select case (name)
      case ("mesh_deformation")
         long_name = " deformation"
      case ("contact_force")
         long_name = " contact force"
      case ("sliding_velocity")
         long_name = " sliding velocity"
      case default
         long_name = " relative displacement"
      end select
   end function long_name

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

   function name_of(input, i) result(name)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(:), allocatable :: name

      call input%get("record", i, "of", name)
   end function name_of

end module razy_scenes_observables
